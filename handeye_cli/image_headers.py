"""What an encoded image tells before it is decoded: its size, its pages, and where it is damaged.

The decoders' own libraries report damage on stderr, without a name, or paint over it. So a damaged
file is found here and never reaches them.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

from handeye_cli.errors import InputError

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"

_PNG_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
"""Bits per sample that each colour type of a PNG allows."""
_PNG_PALETTE = 3
_PNG_PIXELS = (b"IHDR", b"PLTE", b"IDAT", b"IEND")
"""The chunks that the pixels depend on; all others are metadata."""

_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_START_OF_SCAN, _END_OF_IMAGE = 0xDA, 0xD9
_BETWEEN_SCANS = frozenset({0xC4, 0xDA, 0xDB, 0xDC, 0xDD, 0xFE, *range(0xE0, 0xF0)})
"""Markers that may follow the pixels of a scan: tables, comments, further scans."""
_AFTER_PIXELS = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
"""A marker that ends coded pixels: no escaped 0xff, no filling, no restart."""

_PADDING = 16
"""More bytes than a decoder looks ahead, fewer than a block of pixels may take."""

_TIFF_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
_MOST_PAGES = 100
"""Pages that are counted."""
_NO_PAGE = 0b101
"""Bits of a TIFF's NewSubfileType for a preview or a mask of another page."""


class _Chunk(NamedTuple):
    """A PNG's chunk: its type, and the bytes from its length to its checksum."""

    type: bytes
    start: int
    end: int


class _Segment(NamedTuple):
    """A JPEG's segment: its marker, and the bytes from its length to its end."""

    marker: int
    start: int
    end: int


def stated_size(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) as a PNG, JPEG or TIFF states it before its pixels, else None."""
    if data.startswith(_PNG):
        known = data[12:16] == b"IHDR" and len(data) >= 24
        return struct.unpack_from(">II", data, 16) if known else None
    if data.startswith(_JPEG):
        return _jpeg_size(data)
    page = next(_tiff_pages(data), None)
    return None if page is None else (page.get(256, 0), page.get(257, 0))


def require_sound(data: bytes, label: str) -> bytes:
    """Check that an encoded image is all there and is one picture, as far as that shows.

    A PNG's checksums are verified, a JPEG is followed to its end marker; in other formats damage
    is left to the decoder.

    Args:
        data: The encoded image, of any format.
        label: Name of the image for error messages.

    Returns:
        The bytes to decode: a PNG without its metadata, over which its decoder complains, a JPEG
        with which its decoder fails when pixels are missing before its end.

    Raises:
        InputError: It is damaged, or has more than one picture.
    """
    if data.startswith(_PNG):
        return _sound_png(data, label)
    if data.startswith(_JPEG):
        return _sound_jpeg(data, label)
    if data[:4] in _TIFF_ORDERS:
        _require_one(sum(1 for page in _tiff_pages(data) if not page.get(254, 0) & _NO_PAGE), label)
    if data[:4] == b"RIFF" and data[8:16] == b"WEBPVP8X" and data[20:21] and data[20] & 2:
        _require_one(max(2, data.count(b"ANMF")), label)
    if data[:4] == b"GIF8":
        # the block before each frame that says how long it is shown
        _require_one(data.count(b"!\xf9\x04"), label)
    return data


def _require_one(pictures: int, label: str) -> None:
    if pictures > 1:
        raise InputError(
            f"expected one picture, found {pictures} in one file",
            where=label,
            hint="save the one that was taken at the station as a file of its own",
        )


def _damaged(kind: str, data: bytes, reason: str, label: str) -> InputError:
    return InputError(
        f"expected a whole {kind}, found {len(data)} bytes that cannot be decoded: {reason}",
        where=label,
        hint="copy or record it again",
    )


def _sound_png(data: bytes, label: str) -> bytes:
    view = memoryview(data)
    kept, types = [view[: len(_PNG)]], []
    for chunk in _png_chunks(data, label):
        stored = int.from_bytes(data[chunk.end - 4 : chunk.end], "big")
        if zlib.crc32(view[chunk.start + 4 : chunk.end - 4]) != stored:
            where = f"its part {_name(chunk.type)} at byte {chunk.start}"
            raise _damaged("PNG", data, f"{where} has a wrong checksum", label)
        if chunk.type == b"acTL":
            _require_one(int.from_bytes(data[chunk.start + 8 : chunk.start + 12], "big"), label)
        # an upper-case letter says that a decoder must know the chunk
        if chunk.type in _PNG_PIXELS or chunk.type[:1].isupper():
            kept.append(view[chunk.start : chunk.end])
            types.append(chunk.type)
    _require_png_parts(data, types, label)
    return b"".join(kept)


def _png_chunks(data: bytes, label: str) -> Iterator[_Chunk]:
    """Yield the chunks of a PNG up to its end chunk.

    Raises:
        InputError: The data end before it.
    """
    kind, start = b"", len(_PNG)
    while kind != b"IEND":
        if start + 8 > len(data):
            raise _damaged("PNG", data, "it is cut off before its end chunk", label)
        kind = data[start + 4 : start + 8]
        end = start + 12 + int.from_bytes(data[start : start + 4], "big")
        if end > len(data):
            there = f"{len(data) - start} of {end - start} bytes"
            reason = f"it is cut off, of its part {_name(kind)} there are {there}"
            raise _damaged("PNG", data, reason, label)
        yield _Chunk(kind, start, end)
        start = end


def _require_png_parts(data: bytes, types: list[bytes], label: str) -> None:
    """Check that the chunks with pixels are those of a picture, as a decoder insists on."""
    unknown = [each for each in types if each not in _PNG_PIXELS]
    if unknown or types[0] != b"IHDR":
        found = f"the part {_name((unknown or types)[0])}"
        raise InputError(f"expected a standard PNG, found {found}", where=label)
    width, height, depth, colour, *methods, interlaced = struct.unpack_from(">IIBBBBB", data, 16)
    if depth not in _PNG_DEPTHS.get(colour, ()) or any(methods) or interlaced > 1:
        found = f"{depth} bits of colour type {colour}, methods {methods}, interlace {interlaced}"
        raise InputError(f"expected a standard PNG, found {found}", where=label)
    if not width or not height:
        raise InputError(f"expected an image, found one of {width} x {height}", where=label)
    needed = (b"IDAT",) if colour != _PNG_PALETTE else (b"PLTE", b"IDAT")
    for part in needed:
        if part not in types:
            raise _damaged("PNG", data, f"it has no part {_name(part)}", label)


def _name(kind: bytes) -> str:
    return repr(kind.decode("latin-1"))


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    for segment in _jpeg_segments(data):
        if segment.marker in _START_OF_FRAME and segment.start + 7 <= len(data):
            height, width = struct.unpack_from(">HH", data, segment.start + 3)
            return width, height
    return None


def _sound_jpeg(data: bytes, label: str) -> bytes:
    """Return a JPEG that goes on to its end marker; what follows that is none of the picture.

    At the marker a decoder fills what is missing of the pixels with grey. Where it meets zeros
    instead it fails, and those it does not need do no harm.
    """
    segments: list[_Segment] = []
    scanned = False
    for each in _jpeg_segments(data):
        if each.marker == _END_OF_IMAGE and scanned:
            alone = _has_one_scan(data, segments)
            return data[: each.start - 2] + bytes(_PADDING) if alone else data[: each.start]
        if scanned and each.marker not in _BETWEEN_SCANS:
            reason = f"a marker {each.marker:02x} is among its pixels at byte {each.start - 1}"
            raise _damaged("JPEG", data, reason, label)
        if each.end > len(data):
            break
        scanned |= each.marker == _START_OF_SCAN
        segments.append(each)
    raise _damaged("JPEG", data, "it is cut off before its end marker", label)


def _has_one_scan(data: bytes, segments: list[_Segment]) -> bool:
    """Say whether the decoder goes through the pixels once: one scan with all of the colours."""
    frames = [each for each in segments if each.marker in _START_OF_FRAME]
    scans = [each for each in segments if each.marker == _START_OF_SCAN]
    if [each.marker for each in frames] not in ([0xC0], [0xC1]) or len(scans) != 1:
        return False
    # a length, a precision and two sides come before the number of the colours
    return data[frames[0].start + 7 : frames[0].start + 8] == data[scans[0].start + 2 :][:1]


def _jpeg_segments(data: bytes) -> Iterator[_Segment]:
    """Yield the segments of a JPEG up to its end, without the pixels that follow a scan's."""
    position = len(_JPEG)
    while position + 2 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if marker == 0xFF:
            position += 1
            continue
        start = position + 2
        if marker == _END_OF_IMAGE:
            yield _Segment(marker, start, start)
            return
        end = start + max(2, int.from_bytes(data[start : start + 2], "big"))
        yield _Segment(marker, start, end)
        position = end
        if marker == _START_OF_SCAN:
            found = _AFTER_PIXELS.search(data, end)
            position = found.start() if found else len(data)


def _tiff_pages(data: bytes) -> Iterator[dict[int, int]]:
    """Yield the tags with one number of each page of a TIFF, as far as its chain of pages goes."""
    order = _TIFF_ORDERS.get(data[:4])
    if order is None or len(data) < 8:
        return
    (offset,) = struct.unpack_from(order + "I", data, 4)
    for _ in range(_MOST_PAGES):
        if not 8 <= offset <= len(data) - 6:
            return
        (count,) = struct.unpack_from(order + "H", data, offset)
        after = offset + 2 + 12 * count
        if after + 4 > len(data):
            return
        yield dict(_tiff_tag(data, order, place) for place in range(offset + 2, after, 12))
        (offset,) = struct.unpack_from(order + "I", data, after)


def _tiff_tag(data: bytes, order: str, place: int) -> tuple[int, int]:
    tag, kind = struct.unpack_from(order + "HH", data, place)
    short = kind == 3
    return tag, struct.unpack_from(order + ("H" if short else "I"), data, place + 8)[0]
