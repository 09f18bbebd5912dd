"""Daemon and tests are built from the same libraries: neither `make demo` nor `make test` builds again for
the other.
"""

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def libraries(*selection: str) -> dict[str, str]:
    """Features of each library version, as Cargo chooses them for what is selected."""
    command = [
        "cargo",
        "tree",
        "--locked",
        "--offline",
        "--prefix",
        "none",
        "--format",
        "{p}\t{f}",
        *selection,
    ]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    rows = (line.removesuffix(" (*)").split("\t") for line in lines if "\t" in line)
    found: dict[str, set[str]] = {}
    for package, features in rows:
        found.setdefault(package, set()).add(features)
    return {package: " | ".join(sorted(variants)) for package, variants in found.items()}


def test_the_tests_turn_on_no_feature_that_the_daemon_is_built_without() -> None:
    daemon = libraries("--package", "pdnd", "--edges", "normal,build")
    everything = libraries("--workspace", "--edges", "normal,build,dev")
    assert len(daemon) > 200
    differing = {
        package: f"[{features}] for pdnd, [{everything[package]}] for the tests"
        for package, features in daemon.items()
        if everything[package] != features
    }
    remedy = (
        "name the missing features in service/Cargo.toml, or what depends on these libraries is built twice"
    )
    assert not differing, f"{remedy}: {differing}"
