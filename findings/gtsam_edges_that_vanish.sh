#!/bin/sh
# GTSAM's g2o reader loses edges without a word: EDGE_SE3_OFFSET, and all that follow one without information.
#
# A graph with sensors mounted off the vertices loses all its edges. At an edge without information the reader
# ends as if the file did: what comes later is not read.
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

print("gtsam", importlib.metadata.version("gtsam"))
vertices = "".join(f"VERTEX_SE3:QUAT {k} {k} 0 0 0 0 0 1\n" for k in range(5))
information = "100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 100 0 0 100 0 100"
step = "1.5 0 0 0 0 0 1"
pairs = [(k, k + 1) for k in range(4)]
files = {
    "plain": "".join(f"EDGE_SE3:QUAT {a} {b} {step} {information}\n" for a, b in pairs),
    "offsets": "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n"
    + "".join(f"EDGE_SE3_OFFSET {a} {b} 0 0 {step} {information}\n" for a, b in pairs),
    "no information": "".join(f"EDGE_SE3:QUAT {a} {b} {step}\n" for a, b in pairs),
}
seen = {}
for name, edges in files.items():
    path = pathlib.Path(sys.argv[1], "graph.g2o")
    path.write_text(vertices + edges)
    graph, values = gtsam.readG2o(str(path), True)
    seen[name] = graph.size(), round(2.0 * graph.error(values), 6)
    print(f"{name}: {seen[name][0]} of 4 edges, chi2 {seen[name][1]}")
print("expected: 4 edges each, or an error; seen: as above, no error and no warning")
edges = [seen[name][0] for name in ("plain", "offsets", "no information")]
sys.exit(0 if edges == [4, 0, 1] else "this has changed")
PY
