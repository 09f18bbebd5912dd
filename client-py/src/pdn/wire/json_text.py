"""Plain values as JSON text, spelled as the service spells it, so that both write the same bytes."""

from collections.abc import Iterator
from decimal import Decimal
from json.encoder import encode_basestring
from typing import Any

from .scalars import Single


def json_text(value: Any, indent: int | None = None) -> str:
    """The text of a plain value, in one line unless an indent is given."""
    return "".join(_pieces(value, indent, 0))


def _pieces(value: Any, indent: int | None, depth: int) -> Iterator[str]:
    match value:
        case dict():
            colon = ":" if indent is None else ": "
            named = ((encode_basestring(name) + colon, inner) for name, inner in value.items())
            yield from _enclosed("{}", named, indent, depth)
        case list():
            yield from _enclosed("[]", (("", inner) for inner in value), indent, depth)
        case str():
            yield encode_basestring(value)
        case bool() | None:
            yield _WORDS[value]
        case int():
            yield str(value)
        case _:
            yield number(value)


def _enclosed(
    brackets: str, inside: Iterator[tuple[str, Any]], indent: int | None, depth: int
) -> Iterator[str]:
    line = "" if indent is None else "\n" + " " * (indent * (depth + 1))
    before = brackets[0] + line
    for name, inner in inside:
        yield before + name
        yield from _pieces(inner, indent, depth + 1)
        before = "," + line
    if before[0] != ",":
        yield brackets
    else:
        yield ("" if indent is None else "\n" + " " * (indent * depth)) + brackets[1]


_WORDS = {True: "true", False: "false", None: "null"}


def number(value: float) -> str:
    """The shortest decimal that is this number, with an exponent where the service writes one.

    That is from 10^16 on and below 10^-5; of numbers of 32 bits from 10^13 on and below 10^-6.
    """
    text = repr(float(value))
    least, end = (-6, 13) if isinstance(value, Single) else (-5, 16)
    if value == 0.0 or 1e-4 <= abs(value) < 10.0**end:  # where Python spells all digits too
        return text
    decimal = Decimal(text)
    exponent = decimal.adjusted()
    digits = "".join(map(str, decimal.as_tuple().digits)).rstrip("0")
    sign = "-" if value < 0 else ""
    if least <= exponent < 0:
        return f"{sign}0.{'0' * (-exponent - 1)}{digits}"
    return f"{sign}{digits[0]}{'.' if digits[1:] else ''}{digits[1:]}e{exponent:+d}"
