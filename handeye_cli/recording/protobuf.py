"""Messages written as protobuf, read by the numbers of their fields.

The numbers of published messages never change, so the descriptor in the file is not needed, which
may be missing or damaged. A field that is missing has its default, a field that the layout does not
have is passed over.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

from handeye_cli.recording.layout import (
    MANY,
    Field,
    Kind,
    Layout,
    Values,
    nanoseconds,
    require_few,
    seconds_and_rest,
)

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_SIZES = {_FIXED64: 8, _FIXED32: 4}
_LONGEST_VARINT = 10
_UINT64 = 2**64
_DOUBLE, _UINT32 = struct.Struct("<d"), struct.Struct("<I")

Put = Callable[[Values, bytes, int, int], None]
"""Sets a field of a record, or lengthens its sequence, by a stretch of a payload."""


def decoder(layout: Layout) -> Callable[[bytes], Values]:
    """Return the function that decodes payloads of some layout.

    It raises struct.error or ValueError for a payload that is none.
    """
    message = _Message(layout)

    def decode(data: bytes) -> Values:
        record = message.empty()
        message.read_into(record, data, 0, len(data))
        return record

    return decode


class _Message:
    """Reads one kind of message.

    Args:
        layout: Its fields; those that are neither single nor a sequence are arrays of float64.
    """

    def __init__(self, layout: Layout) -> None:
        self._fields = layout.fields
        self._arrays = tuple(field for field in layout.fields if field.count > 1)
        self._parts = {
            field.name: _Message(field.kind)
            for field in layout.fields
            if isinstance(field.kind, Layout)
        }
        self._puts = {
            field.number: (field.name, _wires(field), self._put(field)) for field in layout.fields
        }

    def empty(self) -> Values:
        """Return the message without any field."""
        return {field.name: self._default(field) for field in self._fields}

    def read_into(self, record: Values, data: bytes, start: int, stop: int) -> None:
        """Set the fields of a record, or lengthen its sequences, by a stretch of a payload."""
        for number, wire, begin, end in _values(data, start, stop):
            if number in self._puts:
                name, wires, put = self._puts[number]
                if wire not in wires:
                    raise ValueError(f"wire type {wire} of {name!r}, which has {wires[0]}")
                put(record, data, begin, end)
        for field in self._arrays:
            _require_whole(record, field)

    def _default(self, field: Field) -> Any:
        if field.name in self._parts and field.count == 1:
            return self._parts[field.name].empty()
        if field.is_bytes:
            return b""
        if field.count != 1:
            return []
        return "" if field.kind is Kind.STRING else 0

    def _put(self, field: Field) -> Put:
        if field.name in self._parts:
            part = self._parts[field.name]
            return _put_parts(field.name, part) if field.count == MANY else _put_part(field, part)
        if field.kind is Kind.FLOAT64 and field.count != 1:
            return _put_floats(field.name)
        if field.kind is Kind.TIME:
            return _put_time(field.name)
        return _put_single(field)


def _wires(field: Field) -> tuple[int, ...]:
    """Return the wire types a field may have."""
    if field.kind is Kind.FLOAT64:
        return (_FIXED64,) if field.count == 1 else (_BYTES, _FIXED64)
    return (_FIXED32,) if field.kind is Kind.UINT32 else (_BYTES,)


def _put_part(field: Field, part: _Message) -> Put:
    """A message that comes twice is joined, field by field."""
    name = field.name
    return lambda record, data, start, stop: part.read_into(record[name], data, start, stop)


def _put_parts(name: str, part: _Message) -> Put:
    def put(record: Values, data: bytes, start: int, stop: int) -> None:
        new = part.empty()
        part.read_into(new, data, start, stop)
        record[name].append(new)
        require_few(len(record[name]))

    return put


def _put_floats(name: str) -> Put:
    """One of several numbers, or many at once."""

    def put(record: Values, data: bytes, start: int, stop: int) -> None:
        count, rest = divmod(stop - start, _DOUBLE.size)
        if rest:
            raise ValueError(f"{stop - start} bytes of numbers of {name!r}")
        require_few(len(record[name]) + count)
        record[name].extend(struct.unpack_from(f"<{count}d", data, start))

    return put


def _put_time(name: str) -> Put:
    """A `google.protobuf.Timestamp`; one that comes twice is joined."""

    def put(record: Values, data: bytes, start: int, stop: int) -> None:
        parts = dict(enumerate(seconds_and_rest(record[name]), start=1))
        for number, wire, begin, end in _values(data, start, stop):
            if number in parts and wire == _VARINT:
                value = _varint(data, begin, end)[0]
                parts[number] = value - _UINT64 if value >= _UINT64 // 2 else value
        record[name] = nanoseconds(parts[1], parts[2])

    return put


def _put_single(field: Field) -> Put:
    name = field.name

    def put_number(record: Values, data: bytes, start: int, stop: int) -> None:
        (record[name],) = packed.unpack_from(data, start)

    def put_bytes(record: Values, data: bytes, start: int, stop: int) -> None:
        record[name] = data[start:stop]

    def put_text(record: Values, data: bytes, start: int, stop: int) -> None:
        record[name] = data[start:stop].decode("utf-8")

    packed = _DOUBLE if field.kind is Kind.FLOAT64 else _UINT32
    if field.kind in (Kind.FLOAT64, Kind.UINT32):
        return put_number
    return put_bytes if field.is_bytes else put_text


def _values(data: bytes, start: int, stop: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield number and wire type of each field, and where its value starts and stops."""
    at = start
    while at < stop:
        tag, at = _varint(data, at, stop)
        number, wire = tag >> 3, tag & 7
        if not number:
            raise ValueError("a field with the number 0")
        length = _SIZES.get(wire, 0)
        if wire == _BYTES:
            length, at = _varint(data, at, stop)
        elif wire == _VARINT:
            length = _varint(data, at, stop)[1] - at
        elif not length:
            raise ValueError(f"wire type {wire} of the field {number}")
        if length > stop - at:
            raise ValueError(f"{length} bytes of the field {number}, {stop - at} before the end")
        yield number, wire, at, at + length
        at += length


def _varint(data: bytes, at: int, stop: int) -> tuple[int, int]:
    """Return a varint and the place after it."""
    if at < stop and data[at] < 0x80:  # nearly all of them
        return data[at], at + 1
    result = 0
    for place, each in enumerate(data[at : min(stop, at + _LONGEST_VARINT)]):
        result |= (each & 0x7F) << (7 * place)
        if each < 0x80:
            return result % _UINT64, at + place + 1
    raise ValueError("a varint without an end")


def _require_whole(record: Values, field: Field) -> None:
    """Check the length of an array; protobuf leaves out one that was never set."""
    found = len(record[field.name])
    if not found:
        record[field.name] = [0.0] * field.count
    elif found != field.count:
        raise ValueError(f"{found} numbers of {field.name!r}, which has {field.count}")
