"""Messages written as JSON: fields by their names, bytes as base64, times as sec and nsec."""

from __future__ import annotations

import base64
import json
import math
import reprlib
from collections.abc import Callable
from typing import Any

from handeye_cli.recording.layout import (
    MANY,
    SECOND_NS,
    Field,
    Kind,
    Layout,
    Values,
    nanoseconds,
    require_few,
)

MAX_BYTES = 2**26
"""A longer text is refused: parsed, it may take twenty times as much."""


def decoder(layout: Layout) -> Callable[[bytes], Values]:
    """Return the function that decodes payloads of some layout.

    It raises ValueError or RecursionError for a payload that is none.
    """

    def decode(data: bytes) -> Values:
        if len(data) > MAX_BYTES:
            raise ValueError(f"JSON of {len(data)} bytes, more than {MAX_BYTES}")
        return _record(layout, json.loads(data), "")

    return decode


def _record(layout: Layout, value: Any, path: str) -> Values:
    members = _of(dict, value, path, "an object")
    return {
        field.name: _value(field, members.get(field.name), f"{path}{field.name}")
        for field in layout.fields
    }


def _value(field: Field, value: Any, path: str) -> Any:
    """Return the value of a field; a text, a time and numbers that may be many may be missing."""
    if field.is_bytes:
        return base64.b64decode(_of(str, value, path, "base64 text"), validate=True)
    if field.count != 1:
        return _several(field, value, path)
    return _one(field.kind, value, path)


def _several(field: Field, value: Any, path: str) -> list[Any]:
    if value is None and field.kind is Kind.FLOAT64:
        return [0.0] * max(field.count, 0)
    values = _of(list, value, path, "an array")
    if field.count not in (MANY, require_few(len(values))):
        raise ValueError(f"{path}: expected {field.count} numbers, found {len(values)}")
    return [_one(field.kind, each, f"{path}[{k}]") for k, each in enumerate(values)]


def _one(kind: Kind | Layout, value: Any, path: str) -> Any:
    if isinstance(kind, Layout):
        return _record(kind, value, f"{path}.")
    if kind is Kind.STRING:
        return _text(value, path)
    if kind is Kind.TIME:
        return _time(value, path)
    return _float(value, path) if kind is Kind.FLOAT64 else _integer(value, path, 2**32)


def _text(value: Any, path: str) -> str:
    text: str = _of(str, "" if value is None else value, path, "a text")
    text.encode("utf-8")  # half a surrogate pair is a text in JSON, but nowhere else
    return text


def _time(value: Any, path: str) -> int:
    if value is None:
        return 0
    parts = _of(dict, value, path, "an object with sec and nsec")
    seconds = _integer(parts.get("sec"), f"{path}.sec", 2**63)
    return nanoseconds(seconds, _integer(parts.get("nsec"), f"{path}.nsec", SECOND_NS))


def _integer(value: Any, path: str, end: int) -> int:
    if type(value) is not int or not 0 <= value < end:
        raise _unexpected(value, path, f"a whole number from 0 to {end - 1}")
    return value


def _float(value: Any, path: str) -> float:
    if type(value) not in (int, float) or not math.isfinite(value):
        raise _unexpected(value, path, "a number")
    return float(value)


def _of(kind: type, value: Any, path: str, words: str) -> Any:
    if not isinstance(value, kind):
        raise _unexpected(value, path, words)
    return value


def _unexpected(value: Any, path: str, words: str) -> ValueError:
    found = "nothing" if value is None else reprlib.repr(value)
    return ValueError(f"{path.rstrip('.') or 'the message'}: expected {words}, found {found}")
