"""The golden vectors, which the Rust types have written, read and written by Python byte for byte."""

import json
import re
from pathlib import Path

import pytest
from pdn import wire
from pdn.wire.binary import READERS, WRITERS

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "schemas/generated/golden"
VECTORS = sorted(path.stem for path in GOLDEN.glob("*.bin"))
REGISTRY = json.loads((ROOT / "schemas/generated/registry.json").read_text())


def kind_of(vector: str) -> type:
    return getattr(wire, vector.split("-")[0])


def read(vector: str) -> tuple[bytes, bytes]:
    return (GOLDEN / f"{vector}.bin").read_bytes(), (GOLDEN / f"{vector}.json").read_bytes()


def test_every_message_has_vectors_in_both_formats() -> None:
    assert {vector.split("-")[0] for vector in VECTORS} == set(REGISTRY["messages"])
    assert sorted(path.stem for path in GOLDEN.glob("*.json")) == VECTORS


@pytest.mark.parametrize("vector", VECTORS)
def test_a_vector_is_read_and_written(vector: str) -> None:
    kind = kind_of(vector)
    bincode, text = read(vector)
    message = wire.decode(kind, bincode)
    assert type(message) is kind
    assert wire.encode(message) == bincode
    # Bytes tell -0 from 0, which == does not.
    assert wire.encode(wire.decode(kind, text, wire.Format.JSON)) == bincode
    assert wire.encode(message, wire.Format.JSON) == text


@pytest.mark.parametrize("vector", VECTORS)
def test_a_damaged_vector_is_refused_or_read_as_it_stands(vector: str) -> None:
    kind = kind_of(vector)
    bincode, text = read(vector)
    for end in range(0, len(bincode), 1 + len(bincode) // 500):
        with pytest.raises(wire.WireError):
            wire.decode(kind, bincode[:end])
    with pytest.raises(wire.WireError):
        wire.decode(kind, bincode + b"\0")
    with pytest.raises(wire.WireError):
        wire.decode(kind, text[:-1], wire.Format.JSON)
    for bit in range(0, len(bincode) * 8, 1 + len(bincode) * 8 // 500):
        damaged = bytearray(bincode)
        damaged[bit // 8] ^= 1 << bit % 8
        try:
            message = wire.decode(kind, bytes(damaged))
        except wire.WireError:
            continue
        assert len(wire.encode(message)) == len(damaged)


def test_every_variant_stands_in_a_vector() -> None:
    names = re.findall(r"(?<=[<,])\d+:(\w+)", " ".join(REGISTRY["containers"].values()))
    texts = b" ".join(read(vector)[1] for vector in VECTORS)
    assert len(names) >= 25
    for name in names:
        assert f'"{name}"'.encode() in texts, f"no golden vector has the variant {name}"


def test_the_tables_know_every_message() -> None:
    kinds = {kind.__name__ for kind in WRITERS}
    assert kinds == {kind.__name__ for kind in READERS} == set(REGISTRY["messages"])
    assert set(REGISTRY["containers"]) <= set(wire.__all__)
    for name, digits in REGISTRY["messages"].items():
        assert wire.encoding(getattr(wire, name)).endswith(f";pdn.v1.{name}+bincode#{digits}")


def test_a_hash_is_fnv1a_of_the_layouts_that_the_message_reaches() -> None:
    containers = REGISTRY["containers"]
    for message, digits in REGISTRY["messages"].items():
        reached: set[str] = set()
        waiting = [message]
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached.add(name)
                waiting += [
                    word for word in re.findall(r"\b[A-Z]\w+", containers[name]) if word in containers
                ]
        value = 0xCBF29CE484222325
        for byte in "".join(f"{name}={containers[name]}\n" for name in sorted(reached)).encode():
            value = (value ^ byte) * 0x100000001B3 % 2**64
        assert f"{value:016x}" == digits, message


def test_defaults_are_those_of_rust() -> None:
    _, text = read("MissionConfig-default")
    facet = {"origin": [0, 0, 10], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 40, "length_v_m": 20}
    target = wire.from_plain(wire.Target, {"facets": [facet]})
    assert wire.encode(wire.MissionConfig(mission="m", target=target)) == read("MissionConfig-default")[0]
    assert wire.from_json(wire.MissionConfig, text) == wire.MissionConfig(mission="m", target=target)


def test_keys_are_those_of_the_document() -> None:
    document = (ROOT / "schemas/keys.md").read_text()
    suffixes = re.findall(r"^\| `([a-z_/{}]+/[a-z_/{}]+)` \|", document, re.MULTILINE)
    assert sorted(suffix.replace("{name}", "*") for suffix in suffixes) == sorted(wire.Topic)
    codes = re.findall(r"^\| `(\w+)` \|", (ROOT / "schemas/errors.md").read_text(), re.MULTILINE)
    assert codes == list(wire.Code)
