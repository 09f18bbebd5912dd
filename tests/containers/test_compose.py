"""The compose simulation: daemon, vehicle and operator in containers, until the mission completes."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from conftest import ROOT, pdnd_binary

IMAGES = {"PDND_IMAGE": "pdnd:under-test", "PDN_CLIENT_IMAGE": "pdn-client:under-test"}


def run(*command: str, timeout_s: float = 900) -> str:
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, **IMAGES},
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def images() -> Iterator[None]:
    """Both images, from the daemon built here and wheels made here, so that no build reaches a network."""
    if (
        shutil.which("docker-compose") is None
        or subprocess.run(["docker", "info"], capture_output=True).returncode
    ):
        pytest.skip("needs a Docker engine that answers, and docker-compose")
    if os.geteuid() != 0 and shutil.which("debootstrap") is None:
        pytest.skip("making the base images needs root and debootstrap")
    run(str(ROOT / "deploy/base-images.sh"))
    assert pdnd_binary() == ROOT / "target/release/pdnd", "the image takes target/release/pdnd"
    wheels = ROOT / "target/wheels"
    shutil.rmtree(wheels, ignore_errors=True)
    run(
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "-c",
        "client-py/constraints.txt",
        "-w",
        str(wheels),
        "./client-py",
    )
    for name, file in (("PDND_IMAGE", "Dockerfile"), ("PDN_CLIENT_IMAGE", "Dockerfile.client")):
        run("docker", "build", "-q", "-f", f"deploy/{file}", "--target", "prebuilt", "-t", IMAGES[name], ".")
    yield
    run("docker", "image", "rm", "-f", *IMAGES.values())


@pytest.mark.timeout(1800)
@pytest.mark.usefixtures("images")
def test_a_mission_completes_in_containers() -> None:
    compose = ["docker-compose", "-f", "deploy/compose.yaml", "-f", "tests/containers/compose.pond.yaml"]
    try:
        run(*compose, "up", "--no-build", "--abort-on-container-exit", "--exit-code-from", "operator")
        said = run(*compose, "logs", "--no-color")
    finally:
        run(*compose, "down", "--volumes", "--timeout", "10")
    assert "completed" in said, said[-4000:]
    assert "revisits" in said, said[-4000:]


def test_the_dockerfiles_name_files_that_exist() -> None:
    for name in ("Dockerfile", "Dockerfile.client"):
        for line in Path(ROOT / "deploy" / name).read_text().splitlines():
            words = line.split()
            if words[:1] == ["COPY"] and not words[1].startswith(("--from", "target")):
                for source in words[1:-1]:
                    assert (ROOT / source).exists(), f"{name}: {source}"
