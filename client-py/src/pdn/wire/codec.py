"""Messages to payloads and back."""

import json
import struct
import tomllib
from enum import Enum
from typing import Any, TypeVar, cast

from .binary import READERS, WRITERS
from .errors import WireError, invalid
from .json_text import json_text
from .names import LAYOUT_HASHES, MAX_BYTES, ROOT, VERSION, Code
from .shapes import SHAPES

T = TypeVar("T")

_JSON = "application/json"
_BYTES = "application/octet-stream"


class Format(Enum):
    """How a payload is written."""

    BINCODE = "bincode"
    """Compact and exact; what this library speaks unless told otherwise."""

    JSON = "json"
    """For people and other programs; it cannot carry infinities or NaN."""


def encode(message: object, form: Format = Format.BINCODE) -> bytes:
    """The payload of a message."""
    kind = type(message)
    write = WRITERS.get(kind)
    if write is None:
        raise invalid(f"{kind.__name__} is no message of the contract")
    if form is Format.JSON:
        payload = to_json(message).encode()
    else:
        out = bytearray()
        try:
            write(out, message)
        except (
            struct.error,
            TypeError,
            AttributeError,
            KeyError,
            IndexError,
            OverflowError,
            ValueError,
        ) as error:
            # The plain form is slower but names the field.
            to_plain(message)
            raise invalid(f"the {kind.__name__} cannot be written: {error}") from error
        payload = bytes(out)
    _check_size(kind, payload)
    return payload


def decode(kind: type[T], payload: bytes, form: Format = Format.BINCODE) -> T:
    """The message of a payload, every byte of which must belong to it."""
    read = READERS.get(kind)
    if read is None:
        raise invalid(f"{kind.__name__} is no message of the contract")
    _check_size(kind, payload)
    if form is Format.JSON:
        return from_json(kind, payload)
    try:
        message, end = read(payload, 0)
    except (struct.error, IndexError):
        raise invalid(f"the {kind.__name__} ends too early, after {len(payload)} bytes") from None
    if end != len(payload):
        raise invalid(f"the {kind.__name__} ends after {end} bytes but the payload has {len(payload)}")
    return cast(T, message)


def encoding(kind: type, form: Format = Format.BINCODE) -> str:
    """The text for Zenoh's encoding: format and, for bincode, message, version and layout hash."""
    if form is Format.JSON:
        return _JSON
    return f"{_BYTES};{_schema(kind)}#{LAYOUT_HASHES[kind.__name__]}"


def format_of(kind: type, text: str) -> Format:
    """The format in which a payload of this encoding carries a `kind`; `schema_mismatch` if it does not."""
    if text == _JSON:
        return Format.JSON
    schema, _, digits = text.removeprefix(f"{_BYTES};").partition("#")
    if not text.startswith(f"{_BYTES};") or not schema.endswith("+bincode"):
        raise WireError(
            Code.SCHEMA_MISMATCH, f"encoding {text!r} is neither JSON nor bincode of this contract"
        )
    if schema != _schema(kind):
        raise WireError(
            Code.SCHEMA_MISMATCH, f"expected `{_schema(kind)}`, but the payload says it is `{schema}`"
        )
    if "#" in text and digits != LAYOUT_HASHES[kind.__name__]:
        message = (
            f"the {kind.__name__} has layout {digits}, this library reads {LAYOUT_HASHES[kind.__name__]}: "
        )
        raise WireError(Code.SCHEMA_MISMATCH, message + "install client and service of the same version")
    return Format.BINCODE


def to_plain(value: object) -> Any:
    """A value of the contract as dicts, lists and numbers."""
    shape = SHAPES.get(type(value))
    if shape is None:
        raise invalid(f"{type(value).__name__} is no type of the contract")
    return shape.write(value, "")


def from_plain(kind: type[T], value: object) -> T:
    """A value of the contract from dicts, lists and numbers; what may be left out gets its default."""
    shape = SHAPES.get(kind)
    if shape is None:
        raise invalid(f"{kind.__name__} is no type of the contract")
    return cast(T, shape.read(value, ""))


def to_json(value: object, indent: int | None = None) -> str:
    """A value of the contract as JSON, in one line unless an indent is given."""
    return json_text(to_plain(value), indent)


def from_json(kind: type[T], text: str | bytes) -> T:
    """A value of the contract from JSON."""
    try:
        value = json.loads(text, object_pairs_hook=_object, parse_constant=_constant)
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise invalid(f"not JSON: {error}") from None
    return from_plain(kind, value)


def from_toml(kind: type[T], text: str) -> T:
    """A value of the contract from TOML, which has no null: leave the field out."""
    try:
        value = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise invalid(f"not TOML: {error}") from None
    return from_plain(kind, value)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        names = [name for name, _ in pairs]
        raise invalid(f"`{next(name for name in names if names.count(name) > 1)}` is given twice")
    return value


def _constant(text: str) -> float:
    raise invalid(f"{text} is no number of JSON")


def _mismatch(message: str) -> WireError:
    return WireError(Code.SCHEMA_MISMATCH, message)


def _schema(kind: type) -> str:
    return f"{ROOT}.{VERSION}.{kind.__name__}+bincode"


def _check_size(kind: type, payload: bytes) -> None:
    limit = MAX_BYTES[kind.__name__]
    if len(payload) > limit:
        message = (
            f"a {kind.__name__} of {len(payload)} bytes: at most {limit} bytes are read; send less at once"
        )
        raise WireError(Code.TOO_LARGE, message)
