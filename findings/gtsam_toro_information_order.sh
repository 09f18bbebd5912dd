#!/bin/sh
# GTSAM reads the information matrix of TORO's EDGE3 in the wrong order.
#
# Both formats write the upper triangle over [x, y, z, rotation]. GTSAM's order is [rotation, x, y, z]; its
# reader permutes the matrix of EDGE_SE3:QUAT, and takes that of EDGE3 as it stands: what the file says of the
# translation weighs the rotation.
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
information = "100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 4 0 0 4 0 4"  # 100 of each metre, 4 of each radian.
g2o = f"""VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1
VERTEX_SE3:QUAT 1 1.1 0 0 0 0 0 1
EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {information}
"""
toro = f"""VERTEX3 0 0 0 0 0 0 0
VERTEX3 1 1.1 0 0 0 0 0
EDGE3 0 1 1 0 0 0 0 0 {information}
"""
chi2 = {}
for name, text in (("g2o", g2o), ("TORO", toro)):
    path = pathlib.Path(sys.argv[1], name)
    path.write_text(text)
    graph, values = gtsam.readG2o(str(path), True)
    chi2[name] = 2.0 * graph.error(values)
    print(f"{name}: chi2 {chi2[name]:.6g}, weights", np.diag(graph.at(0).noiseModel().information()))
print("expected: both 1 = 100 * 0.1^2, for the edge is 0.1 m off")
print("seen: the TORO form weighs the same 0.1 m by 4")
seen = abs(chi2["g2o"] - 1.0) < 1e-9 and abs(chi2["TORO"] - 0.04) < 1e-9
sys.exit(0 if seen else "this has changed")
PY
