"""The fields of a message, parsed from its definition: what every encoding of payloads follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

RULE = "=" * 80
"""The line between the definitions of a message and of the messages it is made of."""
MANY = -1
"""The count of a sequence, which says its own length."""
MOST_PARTS = 100_000
"""Longest sequence that is read, but for bytes: a few bytes of a payload may become a part that
takes a hundred times as many."""

LARGEST = 1e30
"""Far beyond any length or pixel, and small enough that no sum of products overflows."""

Values = dict[str, Any]
"""A decoded message: values by the names of its fields, those of nested messages likewise."""

SECOND_NS = 1_000_000_000
_INT64 = 2**63


class Kind(StrEnum):
    """Types of fields, as definitions name them."""

    BOOL = "bool"
    UINT8 = "uint8"
    UINT32 = "uint32"
    FLOAT64 = "float64"
    STRING = "string"
    TIME = "builtin_interfaces/Time"


@dataclass(frozen=True)
class Field:
    """One field.

    Attributes:
        name: Its name; the key of its value in `Values`, and in JSON.
        kind: Its type.
        count: 1, the length of an array, or MANY.
        number: Its number in protobuf.
    """

    name: str
    kind: Kind | Layout
    count: int = 1
    number: int = 0

    @property
    def is_bytes(self) -> bool:
        """Whether it is a sequence of bytes, which stays one object."""
        return self.kind is Kind.UINT8 and self.count == MANY


@dataclass(frozen=True)
class Layout:
    """The fields of a message in the order of ROS.

    Attributes:
        name: The message's name; empty for the one that a definition is of.
        fields: Its fields.
    """

    name: str
    fields: tuple[Field, ...]

    def first(self, count: int) -> Layout:
        """Return the layout of a message that ends after some fields."""
        return Layout(self.name, self.fields[:count])


def parse(definition: str, numbers: Mapping[str, int]) -> Layout:
    """Return the layout that a definition describes.

    Args:
        definition: Lines of a type and a name, as `ros2msg` has them; then, for each nested
            message, RULE, a line `MSG: name` and its own lines.
        numbers: Numbers in protobuf of the fields of the message itself; by default fields are
            numbered in their order.

    Raises:
        ValueError: It names a type that it does not define.
    """
    root, *parts = definition.split(f"{RULE}\nMSG: ")
    lines = dict(part.split("\n", 1) for part in parts)
    return _layout("", root, lines, numbers)


def nanoseconds(seconds: int, rest: int) -> int:
    """Return a time as nanoseconds.

    Raises:
        ValueError: It is centuries away.
    """
    time = seconds * SECOND_NS + rest
    if not -_INT64 <= time < _INT64:
        raise ValueError(f"a time of {seconds} s")
    return time


def seconds_and_rest(time_ns: int) -> tuple[int, int]:
    """Return the whole seconds of a time in nanoseconds, rounded down, and the nanoseconds left."""
    return divmod(time_ns, SECOND_NS)


def require_few(count: int) -> int:
    """Return the length of a sequence.

    Raises:
        ValueError: It is longer than MOST_PARTS.
    """
    if count > MOST_PARTS:
        raise ValueError(f"a sequence of {count} parts, of which at most {MOST_PARTS} are read")
    return count


def _layout(name: str, text: str, lines: Mapping[str, str], numbers: Mapping[str, int]) -> Layout:
    fields = []
    for position, line in enumerate(text.splitlines(), start=1):
        type_name, field_name = line.split()
        base, _, length = type_name.partition("[")
        count = 1 if not length else int(length[:-1] or MANY)
        kind = _layout(base, lines[base], lines, {}) if base in lines else Kind(base)
        fields.append(Field(field_name, kind, count, numbers.get(field_name, position)))
    return Layout(name, tuple(fields))
