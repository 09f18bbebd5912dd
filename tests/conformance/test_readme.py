"""What the README says of the tree is so: the example is the file that runs, versions and links are true."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
PAGES = sorted(path.relative_to(ROOT) for path in [*ROOT.glob("*.md"), ROOT / "client-py/README.md"])


def test_the_example_is_the_file_that_runs_in_the_tests() -> None:
    shown = re.findall(r"^```python\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert shown == [(ROOT / "client-py/examples/own_vehicle.py").read_text()]


def test_the_versions_are_those_that_the_builds_ask_for() -> None:
    rust = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["rust-version"]
    python = tomllib.loads((ROOT / "client-py/pyproject.toml").read_text())["project"]["requires-python"]
    assert f"Rust ({rust} or newer" in README
    assert f"Python {python.removeprefix('>=')} or newer" in README


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)", (ROOT / page).read_text())
    missing = [link for link in links if "://" not in link and not (ROOT / page.parent / link).exists()]
    assert not missing
