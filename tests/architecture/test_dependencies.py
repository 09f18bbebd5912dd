"""What pdn is made of: licences, doubles and sources, as `deny.toml` allows them; no network is needed."""

import json
import re
import shutil
import subprocess
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
DENY = tomllib.loads((ROOT / "deny.toml").read_text(encoding="utf-8"))
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"
TARGET = "x86_64-unknown-linux-gnu"


@cache
def packages() -> list[dict[str, Any]]:
    """Every package that the workspace is built from, by Cargo's word."""
    command = [
        "cargo",
        "metadata",
        "--offline",
        "--locked",
        "--format-version",
        "1",
        "--filter-platform",
        TARGET,
    ]
    found = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
    used = {node["id"] for node in found["resolve"]["nodes"]}
    return [package for package in found["packages"] if package["id"] in used]


def is_allowed(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression can be met by these licences. `/` is how `OR` was once written."""
    words = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))

    def choice() -> bool:
        met = every()
        while words and words[0] == "OR":
            words.pop(0)
            other = every()
            met = met or other
        return met

    def every() -> bool:
        met = one()
        while words and words[0] == "AND":
            words.pop(0)
            other = one()
            met = met and other
        return met

    def one() -> bool:
        word = words.pop(0)
        if word == "(":
            met = choice()
            words.pop(0)
            return met
        if words and words[0] == "WITH":
            word = f"{word} {words.pop(0)} {words.pop(0)}"
        return word in allowed

    return choice()


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("MIT", True),
        ("EPL-2.0 OR MIT", True),
        ("MIT AND GPL-3.0", False),
        ("(MIT OR GPL-3.0) AND Zlib", True),
        ("GPL-3.0/MIT", True),
        ("Apache-2.0 WITH LLVM-exception", False),
    ],
)
def test_a_licence_expression_is_read(expression: str, expected: bool) -> None:
    assert is_allowed(expression, {"MIT", "Zlib"}) == expected


def test_every_licence_is_allowed() -> None:
    allowed = set(DENY["licenses"]["allow"])
    exceptions = {entry["crate"]: set(entry["allow"]) for entry in DENY["licenses"]["exceptions"]}
    refused = {
        f"{package['name']} {package['version']}": package["license"]
        for package in packages()
        if not is_allowed(package["license"] or "none", allowed | exceptions.get(package["name"], set()))
    }
    assert not refused, "replace it, or allow its licence in deny.toml with the reason"
    unused = set(exceptions) - {package["name"] for package in packages()}
    assert not unused, "an exception that nothing needs"


def test_no_crate_comes_twice_without_a_reason() -> None:
    skipped = {entry["crate"]: entry["reason"] for entry in DENY["bans"]["skip"]}
    versions: dict[str, set[str]] = {}
    for package in packages():
        versions.setdefault(package["name"], set()).add(package["version"])
    left = {
        name: sorted(version for version in found if f"{name}@{version}" not in skipped)
        for name, found in versions.items()
    }
    double = {name: found for name, found in left.items() if len(found) > 1}
    assert not double, "use one version, or name the older in deny.toml with the reason"
    stale = [
        crate
        for crate in skipped
        if crate.rpartition("@")[2] not in versions.get(crate.rpartition("@")[0], set())
    ]
    assert not stale, "these are gone: take them out of deny.toml"


def test_everything_comes_from_crates_io_and_nothing_is_banned() -> None:
    assert {package["source"] for package in packages()} == {None, CRATES_IO}
    names = {package["name"] for package in packages()}
    versions = {f"{package['name']}@{package['version'].split('.')[0]}" for package in packages()}
    banned = {entry["crate"] for entry in DENY["bans"]["deny"]}
    assert not banned & (names | versions)
    text = (ROOT / "Cargo.lock").read_text(encoding="utf-8")
    assert "git+" not in text


def test_cargo_deny_agrees() -> None:
    if shutil.which("cargo-deny") is None:
        pytest.skip("cargo-deny is not installed; the tests above hold the same")
    # It reads the crates of every platform, which a build has not brought here: the registry is asked for
    # them.
    command = ["cargo", "deny", "--locked", "check", "bans", "licenses", "sources"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if "failed to fetch crates" in done.stderr:
        pytest.skip("cargo-deny cannot reach the registry; the tests above hold the same")
    assert done.returncode == 0, done.stderr


def test_no_unsafe_code() -> None:
    """The lint forbids it in every crate; this holds that every crate obeys the lint."""
    manifests = [ROOT / "Cargo.toml", *ROOT.glob("service/crates/*/Cargo.toml")]
    members = tomllib.loads(manifests[0].read_text(encoding="utf-8"))["workspace"]["members"]
    for member in members:
        manifest = tomllib.loads((ROOT / member / "Cargo.toml").read_text(encoding="utf-8"))
        assert manifest["lints"] == {"workspace": True}, f"{member} does not take the workspace's lints"
    lints = tomllib.loads(manifests[0].read_text(encoding="utf-8"))["workspace"]["lints"]
    assert lints["rust"]["unsafe_code"] == "forbid"


def test_every_python_dependency_is_pinned() -> None:
    lines = (ROOT / "client-py/constraints.txt").read_text(encoding="utf-8").split()
    project = tomllib.loads((ROOT / "client-py/pyproject.toml").read_text(encoding="utf-8"))
    wanted = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    for extra in project["project"]["optional-dependencies"].values():
        wanted += extra
    names = {re.split(r"[<>=;!~\[ ]", requirement)[0].lower().replace("_", "-") for requirement in wanted}
    assert names - {line.split("==")[0].lower().replace("_", "-") for line in lines} == set()
    assert [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.+]+", line)] == []
