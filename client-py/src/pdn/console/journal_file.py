"""A mission's journal, read through the daemon's own program."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pdn import __version__

from .failures import CommandFailed

Json = dict[str, Any]


@dataclass(frozen=True)
class Record:
    """One record: what it is, and the message as on the wire."""

    number: int
    kind: str
    content: Json
    at_ns: int
    """Its own time, or that of the record before: stamps are the sender's, those of commands the daemon's."""


@dataclass(frozen=True)
class Journal:
    """All records, and what the mission came to."""

    path: Path
    program: Path
    records: list[Record]
    refused: frozenset[int]
    """Numbers of events that changed nothing."""

    @cached_property
    def graph(self) -> Json:
        """As `rpc/graph` answers at the end: keyframes, estimates, covariances. Solves for the graph."""
        return _answer(self.program, self.path, "graph")

    @cached_property
    def coverage(self) -> Json:
        """As `rpc/coverage` answers at the end. Solves for the graph."""
        return _answer(self.program, self.path, "coverage")

    @property
    def configured(self) -> Json:
        """The configuration that counts: the last one."""
        return [record.content for record in self.of("configured")][-1]

    def of(self, *kinds: str) -> list[Record]:
        """The records of these kinds, without events that were refused."""
        return [
            record
            for record in self.records
            if record.kind in kinds and record.content.get("seq") not in self.refused
        ]


def read_journal(path: Path, program: Path) -> Journal:
    """Reads a whole journal; raises ``CommandFailed`` with the program's own words."""
    if not path.is_file():
        raise CommandFailed(f"there is no journal {path}")
    _check_release(program)
    # A record ends at the newline alone: a reason may hold what else Unicode takes for the end of a line.
    lines = [line for line in _ask(program, path, "--json").split("\n") if line]
    records: list[Record] = []
    at_ns = 0
    for line in lines:
        read = json.loads(line)
        content = read["content"]
        at_ns = next((int(content[name]) for name in ("stamp_ns", "at_ns") if name in content), at_ns)
        records.append(Record(read["record"], read["kind"], content, at_ns))
    refused = frozenset(record.content["seq"] for record in records if record.kind == "refused")
    return Journal(path, program, records, refused)


def _answer(program: Path, path: Path, question: str) -> Json:
    answer: Json = json.loads(_ask(program, path, "--answer", question))
    return answer


def _check_release(program: Path) -> None:
    """A daemon of another release may tell its journals in other words."""
    theirs = _run(program, "--version").stdout.split()[-1:]
    if theirs != [__version__]:
        name = f"of release {theirs[0]}" if theirs else "no pdnd"
        raise CommandFailed(
            f"the program {program} is {name}, this client is of {__version__}; "
            "name the pdnd of the same release with --pdnd or PDND_BINARY"
        )


def _ask(program: Path, path: Path, *arguments: str) -> str:
    done = _run(program, "journal", str(path), *arguments)
    if done.returncode != 0:
        raise CommandFailed(done.stderr.strip().removeprefix("pdnd: ") or f"{program} failed on {path}")
    return done.stdout


def _run(program: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    found = str(program.resolve()) if program.is_file() else shutil.which(str(program))
    if found is None:
        raise CommandFailed(
            f"the daemon's program {program} is not there; name it with --pdnd or PDND_BINARY"
        )
    try:
        return subprocess.run(
            [found, *arguments], capture_output=True, encoding="utf-8", errors="replace", check=False
        )
    except OSError as error:
        raise CommandFailed(f"the daemon's program {program} cannot be run: {error.strerror}") from error
