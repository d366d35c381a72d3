"""Payloads that hold the fields of a message one after the other, without their names."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from handeye_cli.recording.layout import MANY, Field, Kind, Layout, Values, nanoseconds, require_few

_CODES = {Kind.BOOL: "?", Kind.UINT8: "B", Kind.UINT32: "I", Kind.FLOAT64: "d"}
"""Numbers by their codes in `struct`."""


@dataclass(frozen=True)
class Form:
    """What distinguishes such encodings.

    Attributes:
        order: Byte order, `<` or `>`.
        widest: A number is aligned to its size or to this, whichever is less.
        seconds: Code in `struct` of the seconds of a time.
        zero_ended: Whether a text ends with a zero, which its length counts.
    """

    order: str
    widest: int
    seconds: str
    zero_ended: bool


class Cursor:
    """A place in a payload that moves on with everything that is read.

    Args:
        data: The payload.
        start: Its first byte that is read, from which alignment counts.
    """

    __slots__ = ("_at", "_data", "_start")

    def __init__(self, data: bytes, start: int) -> None:
        self._data, self._start, self._at = data, start, start

    def numbers(self, packed: struct.Struct, alignment: int) -> tuple[Any, ...]:
        """Return numbers that start at a multiple of some bytes."""
        at = self._at + -(self._at - self._start) % alignment
        self._at = at + packed.size
        return packed.unpack_from(self._data, at)

    def length(self, packed: struct.Struct, alignment: int) -> int:
        """Return a number that says how many of something follow."""
        (length,) = self.numbers(packed, alignment)
        return int(length)

    def octets(self, count: int) -> bytes:
        """Return the next bytes, which must be there."""
        start = self._at
        self._at += count
        return self._data[start : self._at]

    @property
    def left(self) -> int:
        """How many bytes there are still."""
        return len(self._data) - self._at


@dataclass(frozen=True)
class Place:
    """Where something stands in a payload.

    Attributes:
        start: Its first byte.
        stop: The byte after its last.
        order: Byte order, `<` or `>`.
        codes: What stands there, in the codes of `struct`.
        count: How many values these are.
        fixed: Whether it is a length or a text, not numbers.
    """

    start: int
    stop: int
    order: str
    codes: str
    count: int
    fixed: bool


class Trace(Cursor):
    """A cursor that notes where everything stood that was read.

    Attributes:
        places: These, in their order.
    """

    __slots__ = ("places",)

    def __init__(self, data: bytes, start: int) -> None:
        super().__init__(data, start)
        self.places: list[Place] = []

    def numbers(self, packed: struct.Struct, alignment: int) -> tuple[Any, ...]:
        """Return numbers, and note where they stood."""
        values = super().numbers(packed, alignment)
        order, codes = packed.format[0], packed.format[1:]
        self.places.append(
            Place(self._at - packed.size, self._at, order, codes, len(values), fixed=False)
        )
        return values

    def length(self, packed: struct.Struct, alignment: int) -> int:
        """Return a length, and note where it stood."""
        length = super().length(packed, alignment)
        number = self.places.pop()
        self.places.append(replace(number, codes=f"{packed.size}s", fixed=True))
        return length

    def octets(self, count: int) -> bytes:
        """Return bytes, and note where they stood."""
        data = super().octets(count)
        order = self.places[-1].order
        self.places.append(Place(self._at - count, self._at, order, f"{count}s", 1, fixed=True))
        return data


Reader = Callable[[Cursor], Any]


def reader(layout: Layout, form: Form) -> Callable[[Cursor], Values]:
    """Return the function that reads a message of some layout where a cursor stands.

    The function raises struct.error or ValueError when the payload is too short or no such message.
    """
    return _Readers(form).of_message(layout)


class _Readers:
    """Makes the functions that read messages of one form, field by field.

    Args:
        form: How they are written.
    """

    def __init__(self, form: Form) -> None:
        self._form = form
        self._length = struct.Struct(form.order + "I")
        self._time = struct.Struct(f"{form.order}{form.seconds}I")
        self._of_length = min(self._length.size, form.widest)

    def of_message(self, layout: Layout) -> Callable[[Cursor], Values]:
        names = tuple(field.name for field in layout.fields)
        if {(field.kind, field.count) for field in layout.fields} == {(Kind.FLOAT64, 1)}:
            # points and quaternions, of which a recording may have millions
            numbers = self._numbers("d", len(names))
            return lambda cursor: dict(zip(names, numbers(cursor), strict=True))
        readers = tuple((field.name, self._of_field(field)) for field in layout.fields)
        return lambda cursor: {name: read(cursor) for name, read in readers}

    def _of_field(self, field: Field) -> Reader:
        if field.is_bytes:
            return self._octets
        code = _CODES.get(field.kind) if isinstance(field.kind, Kind) else None
        if field.count == MANY:
            return self._many(code) if code else self._parts(self._of_one(field.kind))
        if code is None:
            return self._of_one(field.kind)
        numbers = self._numbers(code, field.count)
        return numbers if field.count > 1 else lambda cursor: numbers(cursor)[0]

    def _of_one(self, kind: Kind | Layout) -> Reader:
        if isinstance(kind, Layout):
            return self.of_message(kind)
        return self._text if kind is Kind.STRING else self._nanoseconds

    def _numbers(self, code: str, count: int) -> Reader:
        packed = struct.Struct(f"{self._form.order}{count}{code}")
        alignment = min(struct.calcsize(f"<{code}"), self._form.widest) if count else 1
        return lambda cursor: cursor.numbers(packed, alignment)

    def _many(self, code: str) -> Reader:
        return lambda cursor: self._numbers(code, require_few(self._count(cursor)))(cursor)

    def _parts(self, one: Reader) -> Reader:
        return lambda cursor: [one(cursor) for _ in range(require_few(self._count(cursor)))]

    def _count(self, cursor: Cursor) -> int:
        """Return the length of what follows, whose parts have at least a byte each."""
        count = cursor.length(self._length, self._of_length)
        if count > cursor.left:
            raise ValueError(f"a length of {count}, {cursor.left} bytes before its end")
        return count

    def _octets(self, cursor: Cursor) -> bytes:
        return cursor.octets(self._count(cursor))

    def _text(self, cursor: Cursor) -> str:
        octets = self._octets(cursor)
        if self._form.zero_ended and octets:
            if octets[-1]:
                raise ValueError(f"a text {octets[:20]!r} that does not end with a zero")
            octets = octets[:-1]
        return octets.decode("utf-8")

    def _nanoseconds(self, cursor: Cursor) -> int:
        seconds, rest = cursor.numbers(self._time, self._of_length)
        return nanoseconds(seconds, rest)
