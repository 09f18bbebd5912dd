"""What README and ARCHITECTURE say of the code is so: each file that they name defines what they say it does.

Two forms are read, wherever they stand:

    [`decide.rs`](service/crates/planning/src/decide.rs): `decide`   a path from the page's folder
    `planning/decide.rs`: `decide`, `choose`                         from the root, or from a crate's name

A name may be qualified: `Type::method`, `module::function`.
"""

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "ARCHITECTURE.md")
COLUMNS = 110

SHORT = {
    **{folder.name: (folder, folder / "src") for folder in (ROOT / "service/crates").iterdir()},
    **{folder.name: (folder,) for folder in (ROOT / "client-py/src/pdn").iterdir() if folder.is_dir()},
    "pdnd": (ROOT / "service/src", ROOT / "service"),
    "schemas": (ROOT / "schemas/src",),
}
"""Where a path that begins with the name of a crate or of a Python package may lead."""

NAME = r"`[A-Za-z_][\w:.]*(?:\(\))?`"
NAMES = rf"{NAME}(?:(?:,|,? and|,? then|,? or| ->| →)\s+{NAME})*"
LINKED = re.compile(rf"\[[^\]]+\]\((?P<path>[^)#:]+)\):\s+(?P<names>{NAMES})")
QUOTED = re.compile(rf"`(?P<path>[\w{{}},-][\w./{{}},-]*)`:\s+(?P<names>{NAMES})")
SUFFIXES = (".rs", ".py", ".toml", ".md", ".json5", ".sh", ".redb")


@dataclass(frozen=True)
class Pair:
    """A file or folder, as a page writes it, and a name that it should define."""

    page: str
    path: str
    name: str

    def __str__(self) -> str:
        return f"{self.page}: {self.path}: {self.name}"


def text_of(page: str) -> str:
    """A page without what is shown as code."""
    return re.sub(r"^```.*?^```$", "", (ROOT / page).read_text(), flags=re.MULTILINE | re.DOTALL)


def is_path(word: str) -> bool:
    """Whether this names a file or folder of the tree and not a key, a command or an item of code."""
    first = word.split("/")[0]
    if "/" not in word:
        return word.endswith(SUFFIXES)
    return first in SHORT or (first not in ("..", "target") and (ROOT / first).is_dir())


def pairs_in(page: str, text: str) -> Iterator[Pair]:
    """The pairs of a text, in both forms."""
    for form in (LINKED, QUOTED):
        for found in form.finditer(text):
            if form is QUOTED and not is_path(found["path"]):
                continue
            for name in re.findall(NAME, found["names"]):
                word = name.strip("`").removesuffix("()")
                if word.endswith(SUFFIXES):
                    break  # The next path of the list, not a name.
                yield Pair(page, found["path"], word)


def expanded(path: str) -> list[str]:
    """`a/{b,c}.rs` as `a/b.rs` and `a/c.rs`."""
    braces = re.search(r"\{([^}]*)\}", path)
    if braces is None:
        return [path]
    return [path[: braces.start()] + choice + path[braces.end() :] for choice in braces[1].split(",")]


def resolved(path: str) -> Path | None:
    """The file or folder that a page means: from the root, or from a crate's or a package's folder.

    The module of a crate may be named without its suffix: `state/convert`. A bare file name is any file of
    the tree that has it.
    """
    first, _, rest = path.partition("/")
    bases = [ROOT / path, *(folder / rest for folder in SHORT.get(first, ()))]
    for base in bases:
        for candidate in (base, base.with_name(f"{base.name}.rs"), base.with_name(f"{base.name}.py")):
            if candidate.exists():
                return candidate
    if "/" not in path:
        return next((ROOT / file for file in tracked() if file.endswith(f"/{path}")), None)
    return None


@cache
def tracked(suffix: str = "") -> tuple[str, ...]:
    """The files of the repository."""
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode != 0:
        pytest.skip(f"needs a git checkout, to know the files of the tree: {listing.stderr.strip()}")
    names = (name for name in listing.stdout.split("\0") if name.endswith(suffix))
    return tuple(name for name in names if (ROOT / name).is_file())


@cache
def code_of(place: Path) -> str:
    """The code of a file, or of all files of a folder, without comments; `mod.rs` stands for its folder."""
    if place.name in ("mod.rs", "__init__.py"):
        place = place.parent
    files = sorted(place.rglob("*")) if place.is_dir() else [place]
    comments = {".rs": r"//[^\n]*", ".py": r'#[^\n]*|"""[\s\S]*?"""', ".toml": r"#[^\n]*"}
    return "\n".join(
        re.sub(comments[file.suffix], "", file.read_text()) for file in files if file.suffix in comments
    )


def defines(place: Path, name: str) -> bool:
    """Whether the file or folder defines an item of that name; of a qualified one each part counts."""
    *owners, last = re.split(r"::|\.", name)
    code = code_of(place)
    named = {part for part in place.with_suffix("").parts if part not in ("src", "mod")}
    return is_defined(code, last) and all(
        owner in named or is_defined(code, owner) or re.search(rf"\bimpl\b[^{{;]*\b{owner}\b", code)
        for owner in owners
    )


def is_defined(code: str, name: str) -> bool:
    item = rf"\b(?:fn|struct|enum|trait|mod|const|static|type|union|macro_rules!|def|class)\s+{name}\b"
    value = rf"^{name}\s*(?::[^=\n]*)?="  # A constant of Python, a key of TOML.
    return re.search(rf"{item}|{value}", code, re.MULTILINE) is not None


def section(page: str, title: str) -> str:
    """What stands below a heading, up to the next of its level; empty if there is none."""
    found = re.search(
        rf"^(#+) [^\n]*{re.escape(title)}[^\n]*\n(.*?)(?=^(?!\1#)#{{1,2}} |\Z)",
        text_of(page),
        re.MULTILINE | re.DOTALL | re.IGNORECASE,
    )
    return found[2] if found else ""


def items(text: str) -> list[str]:
    """The items of the lists of a text, each with the lines that go on with it."""
    return re.findall(r"^ *(?:[-*]|\d+\.) .*(?:\n(?! *(?:[-*]|\d+\.) |\n|#).+)*", text, re.MULTILINE)


PAIRS = [pair for page in PAGES for pair in dict.fromkeys(pairs_in(page, text_of(page)))]


@pytest.mark.parametrize("pair", PAIRS, ids=str)
def test_a_named_file_defines_what_it_is_named_for(pair: Pair) -> None:
    place = ROOT / Path(pair.page).parent / pair.path
    place = place if place.exists() else resolved(pair.path)
    assert place is not None, f"{pair.page} names {pair.path}, which is not in the tree"
    assert defines(place, pair.name), f"{place.relative_to(ROOT)} defines no {pair.name}, as {pair.page} says"


def test_the_readme_maps_the_paper_to_the_code() -> None:
    """The pairs are read at all: a table that is written in another form would go unread."""
    rows = [line for line in section("README.md", "From the paper to the code").splitlines() if "](" in line]
    assert len(rows) >= 10
    assert len([pair for pair in PAIRS if pair.page == "README.md"]) >= 6


def test_each_step_of_a_walk_names_its_function() -> None:
    steps = items(section("ARCHITECTURE.md", "Three walks"))
    assert steps, "ARCHITECTURE.md has no section `Three walks` with lists of `file`: `function`"
    unread = [step for step in steps if not list(pairs_in("ARCHITECTURE.md", step))]
    assert not unread, "these items name no `file`: `function`"


@pytest.mark.parametrize("page", PAGES)
def test_every_path_that_is_named_is_there(page: str) -> None:
    written_by_commands = {"table.md"}
    words = {word.partition("::")[0] for word in re.findall(r"`([^`\s]+)`", text_of(page))}
    paths = [path for word in words - written_by_commands if is_path(word) for path in expanded(word)]
    assert len(paths) > 5
    assert not sorted(path for path in paths if resolved(path) is None)


def test_every_invariant_is_held_by_tests_that_exist() -> None:
    table = section("ARCHITECTURE.md", "Invariants")
    rows = re.findall(r"^\| (\d+)\. [^|]*\|([^\n]*)\|$", table, re.MULTILINE)
    assert [int(number) for number, _ in rows] == list(range(1, len(rows) + 1))
    assert len(rows) >= 7
    assert not [number for number, held_by in rows if "::" not in held_by], "these name no test"
    missing = []
    for number, held_by in rows:
        for word in re.findall(r"`([^`\s]+)`", held_by):
            path, _, test = word.partition("::")
            if not is_path(path):
                continue
            for named in expanded(path):
                place = resolved(named)
                if place is None or (test and not defines(place, test)):
                    missing.append(f"invariant {number}: {word}")
    assert not missing


def keys_of(files: tuple[str, ...]) -> dict[str, set[str]]:
    """The keys of sources, in brackets, that each file names; this one only speaks of them."""
    key = re.compile(r"\[([A-Z][A-Z]*\d{1,2})(?:,[^\]\n]*)?\\?\]")
    this = Path(__file__).relative_to(ROOT).as_posix()
    return {file: set(key.findall((ROOT / file).read_text())) for file in files if file != this}


def defined_sources() -> set[str]:
    sources = section("ARCHITECTURE.md", "Sources")
    return set(re.findall(r"^- \[([A-Z][A-Z0-9]*)\]", sources, re.MULTILINE))


def test_each_source_is_named_in_the_code() -> None:
    named = set().union(*keys_of((*tracked(".rs"), *tracked(".py"))).values())
    assert len(defined_sources()) >= 3
    assert not defined_sources() - named, "sources that no code names"


def test_each_source_that_is_named_is_defined() -> None:
    files = (*tracked(".rs"), *tracked(".py"), *tracked(".md"), *tracked(".toml"))
    undefined = {file: sorted(keys - defined_sources()) for file, keys in keys_of(files).items()}
    assert not {file: keys for file, keys in undefined.items() if keys}


def test_no_line_of_rust_is_longer_than_a_page_is_wide() -> None:
    """rustfmt leaves comments and strings as they are; for Python ruff counts (E501)."""
    long_lines: dict[str, list[int]] = {}
    assert tracked(".rs")
    for file in tracked(".rs"):
        for number, line in enumerate((ROOT / file).read_text().splitlines(), 1):
            if len(line) > COLUMNS:
                long_lines.setdefault(file, []).append(number)
    told = "\n".join(f"{file}: {', '.join(map(str, numbers))}" for file, numbers in long_lines.items())
    assert not long_lines, f"lines of more than {COLUMNS} columns:\n{told}"


def test_the_width_is_that_of_the_formatters() -> None:
    assert f"max_width = {COLUMNS}\n" in (ROOT / "rustfmt.toml").read_text()
    assert f"line-length = {COLUMNS}\n" in (ROOT / "client-py/pyproject.toml").read_text()
