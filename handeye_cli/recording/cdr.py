"""Messages written as CDR, the encoding of ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from handeye_cli.recording.in_order import Cursor, Form, reader
from handeye_cli.recording.layout import Layout, Values

_HEAD_BYTES = 4
_ALIGNMENTS = {b"\x00\x00": 8, b"\x00\x06": 4, b"\x00\x10": 4}
"""Widest alignment by the big-endian identifiers of plain CDR, versions 1 and 2; one more is
little-endian."""


def decoder(layout: Layout) -> Callable[[bytes], Values]:
    """Return the function that decodes payloads of some layout.

    It raises struct.error or ValueError for a payload that is none.
    """

    @cache
    def read(identifier: bytes) -> Callable[[Cursor], Values]:
        return reader(layout, _form(identifier))

    def decode(data: bytes, cursor: Callable[[bytes, int], Cursor] = Cursor) -> Values:
        return read(data[:2])(cursor(data, _HEAD_BYTES))

    return decode


def _form(identifier: bytes) -> Form:
    big_endian = identifier[:1] + bytes(each & ~1 for each in identifier[1:])
    if big_endian not in _ALIGNMENTS:
        raise ValueError(f"plain CDR starts with 0x0000 or 0x0001, found 0x{identifier.hex()}")
    order = ">" if identifier == big_endian else "<"
    return Form(order, _ALIGNMENTS[big_endian], seconds="i", zero_ended=True)
