"""The layers of ARCHITECTURE.md, exactly: a dependency that is new or gone fails here until it is decided."""

import ast
import json
import re
import subprocess
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# crate -> crates of this workspace that it names
CRATES = {
    "pdn-schemas": set(),
    "pdn-kernel": set(),
    "pdn-planning": {"pdn-kernel"},
    "pdn-state": {"pdn-kernel", "pdn-planning", "pdn-schemas"},
    "pdn-transport": {"pdn-schemas"},
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

# package or module below pdn -> those below pdn that it imports; demo and cli compose
PACKAGES = {
    "wire": set(),
    "files": set(),
    "client": {"wire"},
    "sim": {"wire", "files", "client"},
    "console": {"wire", "files", "client"},
    "plots": {"files"},
    "demo": {"files", "sim", "plots"},
    "cli": {"sim", "console", "plots", "demo"},
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


def test_crates_name_those_to_their_left() -> None:
    packages = workspace()
    assert set(packages) == set(CRATES)
    named = {name: dependencies(package) & set(CRATES) for name, package in packages.items()}
    assert named == CRATES


def test_pure_crates_name_no_library_of_the_outside() -> None:
    packages = workspace()
    for name, forbidden in FORBIDDEN.items():
        named = dependencies(packages[name]) & forbidden
        assert not named, f"{name} may not depend on {sorted(named)}"


def test_every_crate_obeys_the_lints_of_the_workspace() -> None:
    def disallowed(path: str) -> set[tuple[str, str]]:
        lists = tomllib.loads((ROOT / path).read_text(encoding="utf-8"))
        return {(kind, entry["path"]) for kind, entries in lists.items() for entry in entries}

    everywhere, method = disallowed("clippy.toml"), disallowed("service/crates/clippy.toml")
    assert method - everywhere == {("disallowed-methods", "std::time::Instant::now")}
    assert everywhere <= method
    assert (ROOT / "service/crates/transport/clippy.toml").resolve() == ROOT / "clippy.toml"


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


def imported(source: Path, root: Path) -> set[str]:
    """What a file imports of the packages and modules directly below pdn, also by a name in a string."""
    inside = ("pdn", *source.relative_to(root).parts[:-1])
    modules: set[str] = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = inside[: len(inside) + 1 - node.level] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            modules |= {f"{module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            modules |= set(re.findall(r"^pdn(?:\.\w+)+$", node.value))
    parts = [module.split(".") for module in modules]
    return {names[1] for names in parts if names[0] == "pdn" and len(names) > 1} & set(PACKAGES)


def test_python_packages_name_those_to_their_left() -> None:
    root = ROOT / "client-py/src/pdn"
    found: dict[str, set[str]] = {}
    for source in sorted(root.rglob("*.py")):
        package = source.relative_to(root).parts[0].removesuffix(".py")
        if package != "__init__":
            found.setdefault(package, set()).update(imported(source, root) - {package})
    assert found == PACKAGES
