#!/usr/bin/env bash
# A list in connect/endpoints is no list of alternatives once connect/timeout_ms is set: the first endpoint that
# refuses is tried again until the time is over, and the next, which is up, never.
# Expected: the second serves when the first refuses. Seen with eclipse-zenoh 1.10.2: without connect/timeout_ms it
# does, at once; with 3000 ms opening fails after 3 s. Exits 1 if either changes.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check eclipse-zenoh==1.10.2
cat > "$work/endpoints.py" <<'PY'
import json, socket, sys, time
import zenoh

def opened(mode, **settings):
    config = zenoh.Config()
    for key, value in (settings | {"mode": mode, "scouting/multicast/enabled": False}).items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)

def attempt(name, **settings):
    began_s = time.monotonic()
    try:
        opened("client", **{"connect/endpoints": [refusing, serving]}, **settings).close()
        outcome = "connected"
    except zenoh.ZError as error:
        outcome = f"failed ({str(error).split(' at ')[0]})"
    print(f"{name}: {outcome} after {time.monotonic() - began_s:.1f} s")
    return outcome == "connected"

with socket.socket() as one, socket.socket() as two:
    one.bind(("127.0.0.1", 0))
    two.bind(("127.0.0.1", 0))
    refusing, serving = (f"tcp/127.0.0.1:{probe.getsockname()[1]}" for probe in (one, two))
print("eclipse-zenoh 1.10.2")
with opened("router", **{"listen/endpoints": [serving]}):
    plain = attempt("without connect/timeout_ms")
    bounded = attempt("with 3000 ms", **{"connect/timeout_ms": 3000, "connect/exit_on_failure": True})
sys.exit(not plain or bounded)
PY
"$work/venv/bin/python" "$work/endpoints.py"
