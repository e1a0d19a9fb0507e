"""Records: what every one of them can, and how they are made of documents."""

from __future__ import annotations

import dataclasses
import html
import sys
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from ._errors import in_keywords

_Kind = TypeVar("_Kind", bound="Record")


@dataclasses.dataclass(frozen=True)
class Record:
    """Frozen, comparable, picklable; `as_dict` gives it as plain data."""

    def as_dict(self) -> dict[str, Any]:
        """The record as dictionaries, tuples, numbers and text."""
        return dataclasses.asdict(self)

    def _repr_html_(self) -> str:
        return f"<table>{''.join(_rows(self, ''))}</table>"


def _rows(record: Record, before: str) -> typing.Iterator[str]:
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        name = f"{before}{field.name}"
        if isinstance(value, Record):
            yield from _rows(value, name + ".")
        elif value is not None and not (isinstance(value, tuple) and not value):
            shown = f"{value:.6g}" if isinstance(value, float) else str(value)
            cells = "".join(f"<td style='text-align:left'>{html.escape(text)}</td>" for text in (name, shown))
            yield f"<tr>{cells}</tr>"


_KINDS: dict[type, Mapping[str, Any]] = {}
#: Fields whose text is a name, and stays as it is.
_NAMES = frozenset({"design", "file", "files", "name", "pictures", "scene", "text"})


def _kinds(kind: type) -> Mapping[str, Any]:
    if kind not in _KINDS:
        _KINDS[kind] = typing.get_type_hints(kind, vars(sys.modules[kind.__module__]))
    return _KINDS[kind]


def _value(kind: Any, value: Any, is_name: bool) -> Any:
    if value is None:
        return None
    if kind is str and not is_name:
        return in_keywords(value)
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Union:
        return _value(next(one for one in parts if one is not type(None)), value, is_name)
    if origin is tuple:
        return tuple(_value(parts[0], one, is_name) for one in value)
    if isinstance(kind, type) and issubclass(kind, Record):
        return of_dict(kind, value)
    return float(value) if kind is float else value


def of_dict(kind: type[_Kind], document: Mapping[str, Any]) -> _Kind:
    """A record of a part of a document."""
    kinds = _kinds(kind)
    return kind(**{name: _value(of, document.get(name), name in _NAMES) for name, of in kinds.items()})
