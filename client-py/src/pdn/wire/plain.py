"""Messages as dicts, lists and numbers: the form that JSON and TOML have.

A `Shape` reads and writes one type. Reading is as strict as the service: unknown and missing fields, numbers
beyond their type, infinities and NaN are refused with the path to them.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np

from .errors import invalid
from .scalars import Shape, below, wrong


class _List:
    """A list of one shape, of any length or of a given one."""

    def __init__(self, inner: Shape, size: int | None) -> None:
        self.inner, self.size = inner, size
        self.expected = "a list" if size is None else f"a list of {size}"

    def _check(self, value: Any, path: str) -> None:
        is_list = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
        if not is_list or (self.size is not None and len(value) != self.size):
            raise wrong(path, self.expected, value)

    def read(self, value: Any, path: str) -> tuple[Any, ...]:
        self._check(value, path)
        return tuple(self.inner.read(one, f"{path}[{index}]") for index, one in enumerate(value))

    def write(self, value: Any, path: str) -> list[Any]:
        self._check(value, path)
        return [self.inner.write(one, f"{path}[{index}]") for index, one in enumerate(value)]


class _Pair:
    """A list of different shapes."""

    def __init__(self, parts: tuple[Shape, ...]) -> None:
        self.parts = parts

    def _each(self, value: Any, path: str) -> list[tuple[Shape, Any, str]]:
        if not isinstance(value, list | tuple) or len(value) != len(self.parts):
            raise wrong(path, f"a list of {len(self.parts)}", value)
        both = enumerate(zip(self.parts, value, strict=True))
        return [(part, one, f"{path}[{index}]") for index, (part, one) in both]

    def read(self, value: Any, path: str) -> tuple[Any, ...]:
        return tuple(part.read(one, where) for part, one, where in self._each(value, path))

    def write(self, value: Any, path: str) -> list[Any]:
        return [part.write(one, where) for part, one, where in self._each(value, path)]


class _Optional:
    """Null or a value."""

    def __init__(self, inner: Shape) -> None:
        self.inner = inner

    def read(self, value: Any, path: str) -> Any:
        return None if value is None else self.inner.read(value, path)

    def write(self, value: Any, path: str) -> Any:
        return None if value is None else self.inner.write(value, path)


class _Map:
    """An object with free keys."""

    def __init__(self, inner: Shape) -> None:
        self.inner = inner

    def read(self, value: Any, path: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise wrong(path, "an object", value)
        return {key: self.inner.read(one, f"{path}.{key}") for key, one in value.items()}

    def write(self, value: Any, path: str) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise wrong(path, "a mapping", value)
        return {key: self.inner.write(value[key], f"{path}.{key}") for key in sorted(value)}


class _Field:
    """A field: its name on the wire, its attribute, its shape, and whether it may be left out."""

    def __init__(self, name: str, attribute: str, shape: Shape, optional: bool) -> None:
        self.name, self.attribute, self.shape, self.optional = name, attribute, shape, optional


class _Record:
    """A struct."""

    def __init__(self, kind: type, fields: tuple[_Field, ...]) -> None:
        self.kind, self.fields = kind, fields
        self.names = {field.name for field in fields}

    def read(self, value: Any, path: str) -> Any:
        if not isinstance(value, dict):
            raise wrong(path, "an object", value)
        if not value.keys() <= self.names:
            unknown = min(value.keys() - self.names)
            known = ", ".join(field.name for field in self.fields)
            raise invalid(f"`{below(path, unknown)}` is unknown; the fields here are: {known or 'none'}")
        arguments = {}
        for field in self.fields:
            where = below(path, field.name)
            if field.name in value:
                arguments[field.attribute] = field.shape.read(value[field.name], where)
            elif not field.optional:
                raise invalid(f"`{where}` is missing")
        return self.kind(**arguments)

    def write(self, value: Any, path: str) -> dict[str, Any]:
        if type(value) is not self.kind:
            raise wrong(path, f"a {self.kind.__qualname__}", value)
        return {
            field.name: field.shape.write(getattr(value, field.attribute), below(path, field.name))
            for field in self.fields
        }


class _Variant:
    """A variant of a union: with no content, one value, or fields."""

    def __init__(self, name: str, kind: type, single: Shape | None, fields: _Record | None) -> None:
        self.name, self.kind, self.single, self.fields = name, kind, single, fields


class _Union:
    """An enum with content: `{"name": content}`, or `"name"` where there is none."""

    def __init__(self, name: str, variants: tuple[_Variant, ...]) -> None:
        self.name = name
        self.by_name = {variant.name: variant for variant in variants}
        self.by_kind = {variant.kind: variant for variant in variants}
        self.expected = f"one of {', '.join(self.by_name)}"

    def read(self, value: Any, path: str) -> Any:
        is_object = isinstance(value, dict) and len(value) == 1
        name, content = next(iter(value.items())) if is_object else (value, None)
        variant = self.by_name.get(name) if isinstance(name, str) else None
        if variant is None or is_object == (variant.single is None and variant.fields is None):
            raise wrong(path, self.expected, value)
        where = below(path, name)
        if variant.single is not None:
            return variant.kind(variant.single.read(content, where))
        return variant.fields.read(content, where) if variant.fields is not None else variant.kind()

    def write(self, value: Any, path: str) -> Any:
        variant = self.by_kind.get(type(value))
        if variant is None:
            raise wrong(path, f"a variant of {self.name} ({self.expected})", value)
        where = below(path, variant.name)
        if variant.single is not None:
            return {variant.name: variant.single.write(value.value, where)}
        return variant.name if variant.fields is None else {variant.name: variant.fields.write(value, where)}


class _Choice:
    """An enum without content."""

    def __init__(self, kind: type[StrEnum]) -> None:
        self.kind = kind
        self.expected = f"one of {', '.join(kind)}"

    def read(self, value: Any, path: str) -> StrEnum:
        if not isinstance(value, str) or value not in list(self.kind):
            raise wrong(path, self.expected, value)
        return self.kind(value)

    def write(self, value: Any, path: str) -> str:
        return self.read(value, path).value


def array(inner: Shape, size: int) -> Shape:
    """A list of exactly `size`."""
    return _List(inner, size)


def listed(inner: Shape) -> Shape:
    """A list of any length."""
    return _List(inner, None)


def paired(*parts: Shape) -> Shape:
    """A list of different shapes."""
    return _Pair(parts)


def optional(inner: Shape) -> Shape:
    """Null or a value."""
    return _Optional(inner)


def mapped(inner: Shape) -> Shape:
    """An object with free keys."""
    return _Map(inner)


def field(name: str, attribute: str, shape: Shape, *, optional: bool = False) -> _Field:
    """A field of a record."""
    return _Field(name, attribute, shape, optional)


def record(kind: type, *fields: _Field) -> _Record:
    """A struct."""
    return _Record(kind, fields)


def variant(name: str, kind: type, *, single: Shape | None = None, fields: _Record | None = None) -> _Variant:
    """A variant of a union."""
    return _Variant(name, kind, single, fields)


def union(name: str, *variants: _Variant) -> Shape:
    """An enum with content."""
    return _Union(name, variants)


def choice(kind: type[StrEnum]) -> Shape:
    """An enum without content."""
    return _Choice(kind)
