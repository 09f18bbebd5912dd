#!/bin/sh
# What GTSAM writes as g2o it does not read back as it was: six digits make information indefinite.
#
# writeG2o uses the stream's default precision. An edge that knows one direction ten million times better than
# another, in turned axes, is a valid measurement before and none after; it is read, and chi2 is another.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check gtsam==4.3.0
"$folder/venv/bin/python" - "$folder" <<'PY'
import importlib.metadata
import pathlib
import sys

import gtsam
import numpy as np

print("gtsam", importlib.metadata.version("gtsam"))
axes, _ = np.linalg.qr(np.arange(36.0).reshape(6, 6) ** 1.5 + 40.0 * np.eye(6))
information = axes @ np.diag([1e-3, 1e-2, 1.0, 10.0, 1e3, 1e4]) @ axes.T
information = (information + information.T) / 2.0
graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
for k in range(2):
    values.insert(k, gtsam.Pose3(gtsam.Rot3(), np.array([1.1 * k, 0.2 * k, 0.3 * k])))
noise = gtsam.noiseModel.Gaussian.Information(information)
graph.add(gtsam.BetweenFactorPose3(0, 1, gtsam.Pose3(gtsam.Rot3(), np.array([1.0, 0.0, 0.0])), noise))
path = str(pathlib.Path(sys.argv[1], "graph.g2o"))
gtsam.writeG2o(graph, values, path)
back, poses = gtsam.readG2o(path, True)
words = pathlib.Path(path).read_text().split("EDGE_SE3:QUAT")[1].split()[9:]
written = np.zeros((6, 6))
written[np.triu_indices(6)] = [float(word) for word in words]
written += np.triu(written, 1).T
before, after = 2.0 * graph.error(values), 2.0 * back.error(poses)
least = np.linalg.eigvalsh(information)[0], np.linalg.eigvalsh(written)[0]
print(f"least eigenvalue before {least[0]:.6g}, in the file {least[1]:.6g}")
print("longest number in the file:", max(words, key=len))
print(f"expected: chi2 {before:.6g} again; seen: {after:.6g}")
sys.exit(0 if np.isfinite(before) and not abs(after - before) < 0.01 * before else "this has changed")
PY
