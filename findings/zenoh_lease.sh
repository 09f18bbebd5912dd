#!/usr/bin/env bash
# Whose lease counts when one side of a Zenoh link falls silent: the silent side's own. Each side announces its
# transport/link/tx/lease to the other, so a router's lease says nothing about when it gives up a client.
# Expected (by the name, and by the comments of many configurations): a router with a lease of 2 s gives up a
# frozen client after 2 s. Seen with eclipse-zenoh 1.10.2: the client's lease decides. Exits 1 if that changes.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check eclipse-zenoh==1.10.2
cat > "$work/lease.py" <<'PY'
import json, signal, socket, subprocess, sys, threading, time
import zenoh

def opened(mode, lease_ms, **settings):
    config = zenoh.Config()
    settings |= {"mode": mode, "scouting/multicast/enabled": False, "transport/link/tx/lease": lease_ms}
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)

if sys.argv[1:]:
    session = opened("client", int(sys.argv[2]), **{"connect/endpoints": [sys.argv[1]]})
    token = session.liveliness().declare_token("silent")
    print("ready", flush=True)
    time.sleep(600)

def gone_after_s(router_ms, client_ms):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    gone = threading.Event()
    with opened("router", router_ms, **{"listen/endpoints": [endpoint]}) as router:
        heard = router.liveliness().declare_subscriber(
            "silent", lambda sample: gone.set() if sample.kind == zenoh.SampleKind.DELETE else None
        )
        client = subprocess.Popen([sys.executable, __file__, endpoint, str(client_ms)], stdout=subprocess.PIPE)
        client.stdout.readline()
        began_s = time.monotonic()
        client.send_signal(signal.SIGSTOP)
        assert gone.wait(60), "never given up"
        took_s = time.monotonic() - began_s
        client.kill()
        client.wait()
        heard.undeclare()
    print(f"router's lease {router_ms} ms, client's {client_ms} ms: frozen client given up after {took_s:.1f} s")
    return took_s

print("eclipse-zenoh", zenoh.__version__ if hasattr(zenoh, "__version__") else "1.10.2")
short, long = gone_after_s(8000, 2000), gone_after_s(2000, 8000)
print("the client's own lease counts" if short < long else "the router's lease counts: this has changed")
sys.exit(short >= long)
PY
"$work/venv/bin/python" "$work/lease.py"
