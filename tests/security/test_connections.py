"""Who does not come in at all, and what our client says about it; and a whole mission over TLS, each by its
role.
"""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import zenoh
from pdn.client import ConnectionFailed, NotAllowed, connect

from conftest import ROOT, free_port, pdnd_binary, start_daemon, wait_until
from secured import Secured, make_certificates, session_as, shipped_configuration, start_secured


def pdn(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line, as a person uses it."""
    command = [sys.executable, "-m", "pdn.cli", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=100, check=False, env=os.environ | environment
    )


@pytest.fixture(scope="module")
def strangers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Certificates of another authority."""
    return make_certificates(tmp_path_factory.mktemp("strangers") / "tls")


@pytest.mark.parametrize(
    "who", ["nobody", "a stranger", "an expired vehicle", "the daemon's key with another's name"]
)
def test_who_does_not_come_in(secured: Secured, strangers: Path, tmp_path: Path, who: str) -> None:
    name, certificates = "vehicle", secured.certificates
    if who == "nobody":
        name = ""
    elif who == "a stranger":
        certificates = strangers
    else:
        certificates = tmp_path
        for file in ("ca.pem", "ca.key"):
            (tmp_path / file).write_bytes((secured.certificates / file).read_bytes())
        if who == "an expired vehicle":
            make_certificates(tmp_path, "--days", "0", "vehicle")
        else:
            make_certificates(tmp_path)
            (tmp_path / "vehicle.key").write_bytes((secured.certificates / "pdnd.key").read_bytes())
    authority = secured.certificates / "ca.pem"
    with pytest.raises(zenoh.ZError), session_as(name, certificates, secured.daemon.endpoint, authority):
        pass


def test_a_role_that_nobody_knows_may_do_nothing(secured: Secured) -> None:
    make_certificates(secured.certificates, "stoker")
    with pytest.raises(Exception, match="no planner has announced itself") as caught:
        connect(
            "hull",
            secured.daemon.endpoint,
            certificate=secured.certificates / "stoker.pem",
            connect_timeout_s=2.0,
        )
    assert "certificate, role" in str(caught.value)


def test_connections_without_tls_are_none(secured: Secured, certificates: Path, tmp_path: Path) -> None:
    """The port speaks TLS only, and pdnd with this configuration listens to nothing else."""
    plain = secured.daemon.endpoint.replace("tls/", "tcp/")
    with pytest.raises(ConnectionFailed, match="speaks TLS: write tls/"):
        connect("hull", plain, connect_timeout_s=1.0)
    configuration = shipped_configuration(certificates, tmp_path)
    command = [pdnd_binary(), "--zenoh-config", configuration, "--listen", f"tcp/127.0.0.1:{free_port()}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    assert done.returncode == 3, done.stderr


EXPLAINED = {
    "no certificate": ({}, "tls", r"asks for a certificate: give one with --certificate"),
    "no such file": ({"certificate": "missing.pem"}, "tls", r"missing.pem cannot be read"),
    "another authority": ({"certificate": "strangers"}, "tls", r"is not of the authority .*ca.pem"),
    "another's key": ({"certificate": "mixed"}, "tls", r"no certificate and the key that belongs to it"),
    "an address that the certificate lacks": (
        {"certificate": "good", "host": socket.gethostname()},
        "tls",
        r"is not made out for",
    ),
    "not trusted by the daemon": ({"certificate": "half"}, "tls", r"does not accept .*half.pem"),
    "no TLS": (
        {"certificate": "good", "plain": True},
        "tls",
        r"does not speak TLS: is it a pdnd without security",
    ),
}


@pytest.mark.parametrize("case", EXPLAINED)
def test_what_is_wrong_is_said(secured: Secured, strangers: Path, tmp_path: Path, case: str) -> None:
    options, protocol, words = EXPLAINED[case]
    good = secured.certificates
    files = {
        "mixed": (good, "vehicle.pem", good, "operator.key", good),
        "half": (strangers, "vehicle.pem", strangers, "vehicle.key", good),
    }
    for name, (one, certificate, other, key, authority) in files.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"{name}.pem").write_bytes((one / certificate).read_bytes())
        (folder / f"{name}.key").write_bytes((other / key).read_bytes())
        (folder / "ca.pem").write_bytes((authority / "ca.pem").read_bytes())
    paths = {
        "good": good / "vehicle.pem",
        "strangers": strangers / "vehicle.pem",
        "mixed": tmp_path / "mixed/mixed.pem",
        "half": tmp_path / "half/half.pem",
        "missing.pem": tmp_path / "missing.pem",
    }
    endpoint = secured.daemon.endpoint
    if "host" in options:
        endpoint = endpoint.replace("127.0.0.1", str(options["host"]))
        try:
            socket.getaddrinfo(str(options["host"]), None)
        except OSError:
            pytest.skip(f"needs a second name of this machine; {options['host']} is not known")
    if options.get("plain"):
        daemon = start_daemon(tmp_path)
        endpoint = daemon.endpoint.replace("tcp/", protocol + "/")
    certificate = paths.get(str(options.get("certificate")))
    with pytest.raises(ConnectionFailed, match=words):
        connect("hull", endpoint, certificate=certificate, connect_timeout_s=1.0)
    if options.get("plain"):
        assert daemon.stop() == 0


def test_the_command_line_says_which_role_it_takes(secured: Secured) -> None:
    show = pdn("mission", "show", "-e", secured.daemon.endpoint, "--vehicle", "hull",
               PDN_CERTIFICATE=str(secured.certificates / "observer.pem"))  # fmt: skip
    assert show.returncode == 0, show.stderr
    pause = pdn("mission", "pause", "-e", secured.daemon.endpoint, "--vehicle", "hull",
                "--certificate", secured.certificates / "observer.pem")  # fmt: skip
    assert pause.returncode == 1
    assert "its certificate is of the role 'observer', and it takes operator" in pause.stderr


def test_a_vehicle_that_may_not_publish_is_told_before_it_sends(secured: Secured) -> None:
    certificate = secured.certificates / "observer.pem"
    with (
        connect("hull", secured.daemon.endpoint, certificate=certificate) as client,
        pytest.raises(NotAllowed, match="of the role 'observer', and it takes vehicle"),
    ):
        client.mission_stream()


@pytest.mark.timeout(300)
def test_a_mission_over_tls_each_by_its_role(certificates: Path, tmp_path: Path) -> None:
    """The operator configures, starts and completes; the vehicle flies; the observer watches."""
    daemon = start_secured(certificates, tmp_path)
    scenario = tmp_path / "two-lines.toml"
    shipped = ROOT / "client-py/src/pdn/sim/scenarios/seafloor.toml"
    scenario.write_text(shipped.read_text().replace("lines = 12", "lines = 2"))
    network = ("-e", daemon.endpoint, "--vehicle", "hull", "--certificate")
    configuration = pdn("sim", scenario, "--print-config", "--mission", "m")
    (tmp_path / "mission.json").write_text(configuration.stdout)

    operator = (*network, certificates / "operator.pem")
    done = pdn("mission", "configure", tmp_path / "mission.json", "--start", *operator)
    assert done.returncode == 0, done.stderr
    command = [sys.executable, "-m", "pdn.cli", "watch", "--json", "--until-ended"]
    seen = tmp_path / "seen.jsonl"
    with (
        seen.open("w") as output,
        subprocess.Popen(
            [*command, *map(str, network), certificates / "observer.pem"], stdout=output
        ) as watching,
    ):
        flown = pdn("sim", scenario, "--json", "--await-operator", 20, *network, certificates / "vehicle.pem")
        assert flown.returncode == 0, flown.stderr
        assert json.loads(flown.stdout)["decisions"] > 0
        done = pdn("mission", "complete", *operator)
        assert done.returncode == 0, done.stderr
        wait_until(lambda: watching.poll() is not None, "the observer to see the end")
    lines = [json.loads(line) for line in seen.read_text().splitlines()]
    assert lines[-1]["state"]["phase"] == "completed"
    assert any("decision" in line for line in lines)
    assert daemon.stop() == 0
