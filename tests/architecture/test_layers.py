"""The layers of ARCHITECTURE.md: a dependency that nobody decided is refused here."""

import ast
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# crate -> crates of this workspace that it may name
CRATES = {
    "pdn-schemas": set(),
    "pdn-kernel": set(),
    "pdn-planning": {"pdn-kernel"},
    "pdn-state": {"pdn-kernel", "pdn-planning", "pdn-schemas"},
    "pdn-transport": {"pdn-planning", "pdn-schemas", "pdn-state"},
    "pdnd": {"pdn-schemas", "pdn-state", "pdn-transport"},
    "pdn-perf": {"pdn-kernel", "pdn-planning"},
}

# crate -> libraries that it must not name, each for the invariant it would break
FORBIDDEN = {
    "pdn-kernel": {"serde", "tokio", "zenoh", "rayon", "rand", "tracing", "bincode"},
    "pdn-planning": {"serde", "tokio", "zenoh", "rand", "tracing", "bincode"},
    "pdn-state": {"tokio", "zenoh", "rand"},
    "pdn-schemas": {"tokio", "zenoh", "nalgebra"},
}

# package below pdn -> packages below pdn that it may import; demo and cli compose
PACKAGES = {
    "wire": set(),
    "files": set(),
    "client": {"wire"},
    "sim": {"wire", "files", "client"},
    "console": {"wire", "files", "client"},
    "plots": {"wire", "files", "client"},
    "demo": {"wire", "files", "client", "sim", "plots"},
    "cli": {"wire", "files", "client", "sim", "console", "plots", "demo"},
}

CLOCKS_AND_IO = (
    "std::time",
    "std::fs",
    "std::net",
    "std::env",
    "std::process",
    "SystemTime",
    "Instant::now",
    "println!",
)


def workspace() -> dict[str, dict]:
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--locked", "--offline"]
    metadata = json.loads(
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    )
    return {package["name"]: package for package in metadata["packages"]}


def dependencies(package: dict) -> set[str]:
    return {dependency["name"] for dependency in package["dependencies"] if dependency["kind"] != "dev"}


def test_crates_name_only_those_to_their_left() -> None:
    packages = workspace()
    assert set(packages) == set(CRATES)
    for name, allowed in CRATES.items():
        inside = {dependency for dependency in dependencies(packages[name]) if dependency in CRATES}
        assert inside <= allowed, f"{name} may not depend on {sorted(inside - allowed)}"


def test_pure_crates_name_no_library_of_the_outside() -> None:
    packages = workspace()
    for name, forbidden in FORBIDDEN.items():
        named = dependencies(packages[name]) & forbidden
        assert not named, f"{name} may not depend on {sorted(named)}"


def test_kernel_and_planning_read_no_clock_and_do_no_io() -> None:
    for crate in ("kernel", "planning"):
        for source in sorted((ROOT / "service/crates" / crate / "src").rglob("*.rs")):
            code = source.read_text().split("#[cfg(test)]")[0]
            lines = [line for line in code.splitlines() if not line.lstrip().startswith("//")]
            for word in CLOCKS_AND_IO:
                assert not any(word in line for line in lines), f"{source.relative_to(ROOT)} names {word}"


def test_only_convert_sees_wire_and_domain_types() -> None:
    source_root = ROOT / "service/crates/state/src"
    for source in sorted(source_root.rglob("*.rs")):
        if source.relative_to(source_root).parts[0].startswith("convert"):
            continue
        code = source.read_text()
        both = "pdn_schemas::" in code and ("pdn_kernel::" in code or "pdn_planning::" in code)
        assert not both, f"{source.relative_to(ROOT)} names wire and domain types; only convert may"


def imported(tree: ast.AST, package: str) -> set[str]:
    """Names of packages below pdn that a module imports, absolutely or relatively."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("pdn.")}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            parts = node.module.split(".")
            if parts[0] == "pdn":
                found |= {parts[1]} if len(parts) > 1 else {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level >= 2 and node.module:
            found.add(node.module.split(".")[0])
    return (found & set(PACKAGES)) - {package}


def test_python_packages_name_only_those_to_their_left() -> None:
    root = ROOT / "client-py/src/pdn"
    for source in sorted(root.rglob("*.py")):
        package = source.relative_to(root).parts[0].removesuffix(".py")
        if package == "__init__":
            continue
        assert package in PACKAGES, f"pdn.{package} stands in no layer"
        extra = imported(ast.parse(source.read_text()), package) - PACKAGES[package]
        assert not extra, f"{source.relative_to(ROOT)} may not import {sorted(extra)}"
