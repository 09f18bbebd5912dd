"""No circle of imports among the modules of a crate: each can be read after those that it names."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [
    "schemas",
    "service",
    *sorted(f"service/crates/{at.name}" for at in (ROOT / "service/crates").iterdir()),
]

# What is no code: comments, raw strings, strings, characters.
NO_CODE = re.compile(
    r"//[^\n]*|/\*.*?\*/"
    r'|\br(?P<hashes>#*)".*?"(?P=hashes)'
    r'|"(?:\\.|[^"\\])*"'
    r"|'(?:\\[^']*|[^'\\])'",
    re.DOTALL,
)
TEST_ITEM = re.compile(r"#\[cfg\(test\)\]\s*(?:mod\s+(?P<module>\w+)\s*;)?")
NAME = re.compile(r"\w+|\*")
# A path from the crate's root, or from modules above.
PATH = re.compile(
    r"(?<![\w$:])(?P<up>crate|(?:self\s*::\s*)?super(?:\s*::\s*super)*)\s*::\s*(?P<rest>[\w{*])"
)
USE = re.compile(r"\buse\s+(?:crate\s*::\s*|self\s*::\s*)?(?P<module>\w+)\s*::\s*(?P<tree>[^;]+);")
LAST_NAME = re.compile(r"(\w+)\s*(?=[,}]|$)")

# For each module directly below a crate's root (a file or a folder), the others that its code names.
Graph = dict[str, set[str]]


def roots() -> list[Path]:
    """The files that crates begin with: libraries and programs."""
    patterns = ["lib.rs", "main.rs", "bin/*.rs", "bin/*/main.rs"]
    return [found for package in PACKAGES for one in patterns for found in (ROOT / package / "src").glob(one)]


def module_graph(root: Path) -> Graph:
    folder = root.parent
    paths = {source: source.relative_to(folder).with_suffix("").parts for source in folder.rglob("*.rs")}
    modules = {
        source: parts[:-1] if parts[-1] == "mod" else parts
        for source, parts in paths.items()
        if parts[0] not in ("lib", "main", "bin")
    }
    for source, module in list(modules.items()):
        for test in modules_for_tests(source):
            below = (*module, test)
            modules = {other: path for other, path in modules.items() if path[: len(below)] != below}
    modules = {other: path for other, path in modules.items() if path[0] not in modules_for_tests(root)}
    graph: Graph = {module[0]: set() for module in modules.values()}
    origins = exported(code(root), set(graph))
    for source, module in modules.items():
        named = {origins.get(name) for name in names_at_the_root(code(source), len(module))}
        graph[module[0]] |= {name for name in named if name} - {module[0]}
    return graph


@cache
def bare(source: Path) -> str:
    """A source without comments and literals."""
    return NO_CODE.sub(" ", source.read_text(encoding="utf-8"))


def modules_for_tests(source: Path) -> set[str]:
    """Modules in files of their own that are compiled for tests alone."""
    return {found["module"] for found in TEST_ITEM.finditer(bare(source)) if found["module"]}


def code(source: Path) -> str:
    """A source without comments, literals and what is compiled for tests alone."""
    text = bare(source)
    while found := TEST_ITEM.search(text):
        end = found.end() if found["module"] else end_of_item(text, found.end())
        text = text[: found.start()] + text[end:]
    return text


def end_of_item(text: str, start: int) -> int:
    """Behind the semicolon or the closing brace that ends an item."""
    depth = 0
    for at in range(start, len(text)):
        depth += (text[at] == "{") - (text[at] == "}")
        if depth == 0 and text[at] in ";}":
            return at + 1
    return len(text)


def exported(root: str, modules: set[str]) -> dict[str, str]:
    """The module that each name at a crate's root comes from; what the root declares comes from none."""
    origins = {module: module for module in modules}
    for use in USE.finditer(root):
        if use["module"] in modules:
            for name in LAST_NAME.findall(use["tree"].strip()):
                origins.setdefault(name, use["module"])
    return origins


def names_at_the_root(text: str, depth: int) -> set[str]:
    """Names that code of a module so many steps below the root takes from the root."""
    found: set[str] = set()
    for path in PATH.finditer(text):
        if path["up"] == "crate" or path["up"].count("super") >= depth:
            found.update(first_names(text, path.start("rest")))
    return found


def first_names(text: str, start: int) -> Iterator[str]:
    """The names that a use tree begins with: one, or those of a group."""
    depth, expected = 0, True
    for at in range(start, len(text)):
        if expected and (text[at].isalnum() or text[at] in "_*"):
            if name := NAME.match(text, at):
                yield name[0]
            expected = False
        depth += (text[at] == "{") - (text[at] == "}")
        expected = expected or (depth == 1 and text[at] in "{,")
        if depth == 0:
            return


def circle(graph: Graph) -> list[str] | None:
    """Modules each of which names the next, the first one at both ends; none if there are none."""
    read: set[str] = set()

    def follow(module: str, way: list[str]) -> list[str] | None:
        if module in way:
            return [*way[way.index(module) :], module]
        if module in read:
            return None
        found = next(
            (found for other in sorted(graph[module]) if (found := follow(other, [*way, module]))), None
        )
        read.add(module)
        return found

    return next((found for module in sorted(graph) if (found := follow(module, []))), None)


@pytest.mark.parametrize("root", roots(), ids=lambda root: str(root.relative_to(ROOT)))
def test_modules_import_in_one_direction(root: Path) -> None:
    found = circle(module_graph(root))
    assert found is None, f"{' -> '.join(found)}: move what they share to a module of its own"


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("use crate::{Other, second::{Thing, part}};", "fn f() { crate::first::g() }", True),
        ("use super::second;", "use crate::{\n    Other,\n    first,\n};", True),
        ("use crate::Exported;", "use crate::first;", True),
        ("use crate::second;", "use crate::{Other, other::first};", False),
        ("use crate::second;", "#[cfg(test)]\nmod tests {\n    use crate::first;\n}", False),
        ("use crate::second;", '// use crate::first;\nconst NAME: &str = "crate::first::g";', False),
        ("use crate::second;", "use self::first::part;", False),
        ("use crate::second;", "#[cfg(test)]\nmod tests;", False),
    ],
)
def test_a_circle_is_found(tmp_path: Path, first: str, second: str, expected: bool) -> None:
    root = tmp_path / "lib.rs"
    root.write_text(
        "mod first;\nmod second;\npub use second::{part::Deep, Thing as Exported};\npub struct Other;\n"
    )
    (tmp_path / "first.rs").write_text(first)
    (tmp_path / "second").mkdir()
    (tmp_path / "second/mod.rs").write_text("mod part;")
    (tmp_path / "second/part.rs").write_text(second)
    (tmp_path / "second/part").mkdir()
    (tmp_path / "second/part/tests.rs").write_text("use crate::first;" if "mod tests;" in second else "")
    assert (circle(module_graph(root)) is not None) == expected
