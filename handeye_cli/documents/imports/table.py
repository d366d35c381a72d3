"""Tables of poses, one a row: CSV with a header, or the plain columns of a TUM trajectory."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from handeye_cli.documents.cameras.intrinsics import number
from handeye_cli.documents.place import Place
from handeye_cli.documents.text import resolve
from handeye_cli.errors import InputError

_TUM = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
_PLACE = frozenset("xyz")
_SEPARATORS = ";,\t"
_COMMENT = "#"
_BRACKET = re.compile(r"[\[(].*")
"""A unit behind a name, as in `x [m]`."""

_POSITION = re.compile(r"(?:field)?(?:pose)*(?:position|translation|pos|p|t)?([xyz])")
_QUATERNION = re.compile(r"(?:field)?(?:pose)*(?:orientation|rotation|quat|q)([xyzw])")
_ANGLE = re.compile(r"(?:rotvec|rot|rv|r)([xyz])")
_NAMES = {
    "image": ("image", "imagefile", "imagepath", "filename", "file", "path", "picture"),
    "key": ("name", "id", "index", "frame", "station", "number"),
    "time": ("timestamp", "time", "t", "stamp", "timens", "timestampns"),
    "rx": ("roll",),
    "ry": ("pitch",),
    "rz": ("yaw",),
}
_COLUMNS = {name: column for column, names in _NAMES.items() for name in names}
_LOOKED_AT = 20_000
"""Bytes in which a table must show what it is."""


class _Line(NamedTuple):
    """A line of a table that is not empty: its number, its cells, and whether it is a comment."""

    at: int
    cells: list[str]
    is_comment: bool


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        cells: Texts by what their columns are: `image`, `key`, `time`, `x`, `y`, `z`, `qx` to
            `qw`, `rx` to `rz`; under an empty text what nothing is known of.
        place: The row's line in the file.
    """

    cells: Mapping[str, str]
    place: Place

    def numbers(self, columns: Sequence[str]) -> list[float]:
        """Return the numbers in columns that are there.

        Raises:
            InputError: A cell holds no finite number.
        """
        return [number(resolve(self.cells[each]), self.place.key(each)) for each in columns]


def is_table(content: bytes) -> bool:
    """Return whether a text starts like a table of poses."""
    try:
        _header(_lines(content[:_LOOKED_AT].decode("utf-8-sig", "ignore")), "")
    except InputError:
        return False
    return True


def rows_of(content: bytes, label: str) -> list[Row]:
    """Return the rows of a table, all with the same columns.

    Args:
        content: The bytes of the file.
        label: Its name.

    Raises:
        InputError: It is no text, has no columns of poses, or a row has other columns.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"found the byte 0x{content[error.start]:02x}"
        raise InputError(f"expected a table in UTF-8 text, {found}", where=label) from error
    start, columns = _header(_lines(text), label)
    rows = [
        _row(line.cells, columns, Place(f"{label}, line {line.at}"))
        for line in _lines(text)
        if line.at >= start and not line.is_comment
    ]
    if not rows:
        raise InputError("expected a table of poses, found no row in it", where=label)
    return rows


def _row(cells: Sequence[str], columns: Sequence[str], place: Place) -> Row:
    if len(cells) != len(columns):
        raise InputError(f"expected {len(columns)} columns, found {len(cells)}", where=str(place))
    return Row(dict(zip(columns, cells, strict=True)), place)


def _lines(text: str) -> Iterator[_Line]:
    for at, line in enumerate(text.splitlines(), start=1):
        content = line.strip()
        words = content.lstrip(_COMMENT)
        if words:
            yield _Line(at, _cells(words), is_comment=words != content)


def _cells(line: str) -> list[str]:
    separator = next((each for each in _SEPARATORS if each in line), None)
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _header(lines: Iterator[_Line], label: str) -> tuple[int, Sequence[str]]:
    """Return the line of the first row, and what the columns are.

    The names stand in the first line, or in a comment before it; without names eight numbers are
    a TUM trajectory's.
    """
    told: list[str] = []
    for at, cells, is_comment in lines:
        names = [_column(cell) for cell in cells]
        has_names = set(names) >= _PLACE
        if is_comment:
            told = names if has_names else told
        elif has_names:
            return at + 1, _once(names, label)
        elif len(told) == len(cells):
            return at, _once(told, label)
        elif len(cells) == len(_TUM) and all(map(_is_number, cells)):
            return at, _TUM
        else:
            break
    raise InputError(
        "expected a header with the columns x, y, z and qx, qy, qz, qw, or the eight numbers of a "
        "TUM trajectory in every row, found neither",
        where=label,
        hint="a column for image, name or timestamp says which picture belongs to a pose",
    )


def _is_number(cell: str) -> bool:
    return isinstance(resolve(cell), int | float)


def _once(columns: list[str], label: str) -> list[str]:
    double = next((each for each in columns if each and columns.count(each) > 1), None)
    if double is not None:
        found = f"found {columns.count(double)}"
        raise InputError(f"expected one column for {double}, {found}", where=label)
    return columns


def _column(name: str) -> str:
    plain = re.sub(r"[^a-z0-9]", "", _BRACKET.sub("", name.lower()))
    if plain in _COLUMNS:
        return _COLUMNS[plain]
    for pattern, prefix in ((_POSITION, ""), (_QUATERNION, "q"), (_ANGLE, "r")):
        match = pattern.fullmatch(plain)
        if match:
            return prefix + match[1]
    return ""
