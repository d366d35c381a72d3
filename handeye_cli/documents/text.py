"""YAML or JSON text into plain data, hardened: JSON is YAML, so one reader does for both.

Scalars follow YAML 1.2: `1e-5` is a number, `no` and `2024-01-01` are text, `010` is ten. The data
are built from the parser's events without recursion, so that neither deep nesting nor an alias of
aliases can exhaust the machine. Two kinds of value keep what the writer wrote: a `name` its
spelling (`00` is not 0), a number of `..._mrad`, `..._mm` or `..._ms` its decimal digits.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any, NamedTuple

import yaml

from handeye_cli.errors import InputError

MAX_BYTES = 256_000_000
"""Largest document that is read."""
MAX_DEPTH = 60
"""Deepest nesting of lists and mappings."""
MAX_ALIASED = 100_000
"""Most values that aliases may stand for in one document."""

_MEANINGS: dict[str, bool | None] = {"null": None, "true": True, "false": False}
_WORDS: dict[str, bool | None] = {
    spelling: meaning
    for word, meaning in _MEANINGS.items()
    for spelling in (word, word.capitalize(), word.upper())
}
_WORDS |= {"": None, "~": None}

_BINARY = {
    b"\x89MCAP": "an MCAP recording cannot be read from a pipe: give its file's name",
    b"\x89PNG": "a picture is named in a recording document: schema: handeye/recording/1",
    b"\xff\xd8\xff": "a picture is named in a recording document: schema: handeye/recording/1",
    b"PK\x03\x04": "arrays of another tool are read by 'handeye import'",
}

_NUMBER_START = frozenset("+-.0123456789")
_INT = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_TEXT_TAGS = frozenset((None, "!", "tag:yaml.org,2002:str"))
_COMMENT = re.compile(r"^[ \t]*(?://|/\*)", re.MULTILINE)
_EXACT_KEYS = ("_mrad", "_mm", "_ms")
_EXACT_RANGE = 1e-200
"""Zero, infinity and what is near them has no digits worth keeping."""


def parse(data: bytes, label: str) -> Any:
    """Read one YAML or JSON document into dicts, lists, text, numbers, booleans and None.

    Args:
        data: The bytes of the document, UTF-8 (or UTF-16 with its byte order mark).
        label: Name of the document for error messages.

    Raises:
        InputError: The text is not valid, repeats a key, is too large or too deep, or uses tags.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"expected a document of at most {MAX_BYTES // 1_000_000} MB, found more", where=label
        )
    text = _decode(data, label)
    _require_text(text, label)
    builder = _Builder(label)
    try:
        for event in _events(text):
            builder.take(event)
    except yaml.MarkedYAMLError as error:
        problem = error.problem or error.context or "not YAML"
        mark = error.problem_mark or error.context_mark
        raise InputError(
            f"not valid YAML or JSON: {problem}", where=_at(label, mark), hint=_hint(text, mark)
        ) from error
    except yaml.reader.ReaderError as error:
        raise InputError(f"not valid YAML or JSON: {error.reason}", where=label) from error
    if not builder.documents:
        raise InputError("expected a document, found nothing", where=label)
    return builder.documents[0]


def resolve(text: str) -> Any:
    """Return what a plain (unquoted) scalar means under the rules of YAML 1.2."""
    if text[:1] in _NUMBER_START:
        if _INT.fullmatch(text):
            return int(text)
        if _FLOAT.fullmatch(text):
            return float(text)
        if _NOT_FINITE.fullmatch(text):
            return float(text.replace(".", ""))
    return _WORDS.get(text, text)


def _decode(data: bytes, label: str) -> str:
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        if wide:
            message = f"expected UTF-16 text, as its first bytes say, found {error.reason}"
            raise InputError(message, where=label, hint="save it as UTF-8") from error
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"expected UTF-8 text, found the byte 0x{data[error.start]:02x}",
            where=f"{label}, line {line}",
            hint=next((hint for magic, hint in _BINARY.items() if data.startswith(magic)), None),
        ) from error


def _require_text(text: str, label: str) -> None:
    """Refuse zero bytes: of binary data, or of UTF-16 and UTF-32 that do not say so."""
    zero = text.find("\0")
    if zero >= 0:
        raise InputError(
            "not valid YAML or JSON: control characters are not allowed, found a zero byte",
            where=f"{label}, line {text.count(chr(10), 0, zero) + 1}",
            hint="if it is a text, save it as UTF-8",
        )


def _hint(text: str, mark: Any) -> str | None:
    """Return what helps where the parser's words do not: with tabs, and with comments of C."""
    if mark is not None and text[mark.index : mark.index + 1] == "\t":
        return "it is a tab: indent with spaces"
    if _COMMENT.search(text):
        return "neither YAML nor JSON has comments with // or /*: take them out, or write #"
    return None


def _events(text: str) -> Iterator[Any]:
    loader = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
    return iter(yaml.parse(text, Loader=loader))


def _at(label: str, mark: Any) -> str:
    return f"{label}, line {mark.line + 1}, column {mark.column + 1}" if mark else label


class _Anchored(NamedTuple):
    """What an alias stands for: the value, how many values it holds, and how deep they nest."""

    value: Any
    size: int
    height: int = 0


@dataclass
class _Open:
    """A list or mapping that is being read; its height is that of the nesting found so far."""

    value: dict[str, Any] | list[Any]
    anchor: str | None
    before: int
    height: int = 1
    key: str | None = None
    key_lines: dict[str, int] = field(default_factory=dict)


class _Builder:
    """Puts plain data together from the events of one text."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.documents: list[Any] = []
        self._open: list[_Open] = []
        self._anchors: dict[str, _Anchored] = {}
        self._count = 0
        self._aliased = 0

    def take(self, event: Any) -> None:
        """Use one event of the parser."""
        if isinstance(event, yaml.ScalarEvent):
            self._scalar(event)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._start(event)
        elif isinstance(event, yaml.CollectionEndEvent):
            closed = self._open.pop()
            whole = _Anchored(closed.value, self._count - closed.before, closed.height)
            self._remember(closed.anchor, whole)
            self._add(whole)
        elif isinstance(event, yaml.AliasEvent):
            self._alias(event)
        elif isinstance(event, yaml.DocumentStartEvent) and self.documents:
            raise self._error("expected one document, found the start of a second", event)

    def _error(self, message: str, event: Any) -> InputError:
        return InputError(message, where=_at(self.label, event.start_mark))

    def _scalar(self, event: Any) -> None:
        if event.tag not in _TEXT_TAGS:
            raise self._error(f"expected plain data, found the tag {event.tag!r}", event)
        self._count += 1
        if self._expects_key():
            self._key(event)
            return
        single = _Anchored(self._value(event) if event.implicit[0] else event.value, 1)
        self._remember(event.anchor, single)
        self._add(single)

    def _expects_key(self) -> bool:
        top = self._open[-1] if self._open else None
        return top is not None and isinstance(top.value, dict) and top.key is None

    def _value(self, event: Any) -> Any:
        key = self._open[-1].key if self._open else None
        if key == "name":
            return event.value
        value = resolve(event.value)
        if key and key.endswith(_EXACT_KEYS) and isinstance(value, float):
            exact = _EXACT_RANGE < abs(value) < 1.0 / _EXACT_RANGE
            return Decimal(event.value) if exact else value
        return value

    def _key(self, event: Any) -> None:
        top = self._open[-1]
        line = event.start_mark.line + 1
        if event.value in top.key_lines:
            first = top.key_lines[event.value]
            raise self._error(f"the key {event.value!r} was given before, in line {first}", event)
        top.key_lines[event.value] = line
        top.key = event.value

    def _start(self, event: Any) -> None:
        if event.tag not in (None, "!"):
            raise self._error(f"expected plain data, found the tag {event.tag!r}", event)
        if self._expects_key():
            raise self._error("expected a text as key, found a list or mapping", event)
        self._require_depth(1, event)
        value: dict[str, Any] | list[Any] = {} if isinstance(event, yaml.MappingStartEvent) else []
        self._open.append(_Open(value, event.anchor, self._count))
        self._count += 1

    def _alias(self, event: Any) -> None:
        if event.anchor not in self._anchors:
            raise self._error(f"the alias *{event.anchor} stands for nothing before it", event)
        if self._expects_key():
            raise self._error("expected a text as key, found an alias", event)
        meant = self._anchors[event.anchor]
        self._require_depth(meant.height, event)
        self._count += meant.size
        self._aliased += meant.size
        if self._aliased > MAX_ALIASED:
            raise self._error(
                f"expected aliases for at most {MAX_ALIASED} values, found more", event
            )
        self._add(meant)

    def _require_depth(self, height: int, event: Any) -> None:
        if len(self._open) + height > MAX_DEPTH:
            raise self._error(f"expected at most {MAX_DEPTH} levels of nesting, found more", event)

    def _remember(self, anchor: str | None, found: _Anchored) -> None:
        if anchor is not None:
            self._anchors[anchor] = found

    def _add(self, found: _Anchored) -> None:
        if not self._open:
            self.documents.append(found.value)
            return
        top = self._open[-1]
        top.height = max(top.height, found.height + 1)
        if isinstance(top.value, list):
            top.value.append(found.value)
        elif top.key is not None:
            top.value[top.key] = found.value
            top.key = None
