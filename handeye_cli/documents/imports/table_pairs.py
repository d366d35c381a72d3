"""Which row of a table belongs to which image: by what the image is called, or by its time."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path, PurePath

import numpy as np

from handeye_cli.documents.imports.pose_pairs import PlacedPose, recorded, robot_pose
from handeye_cli.documents.imports.table import Row
from handeye_cli.documents.poses import PoseConventions
from handeye_cli.documents.written import written_between
from handeye_cli.errors import InputError
from handeye_cli.geometry.trajectory import between
from handeye_cli.images import ImageFile
from handeye_cli.records import IntArray, RecordedStation

_WHOLE = re.compile(r"[0-9]{1,18}")
_NANOSECONDS = Decimal(10) ** 15
"""A time from here on is in nanoseconds: as seconds it would be 30 million years."""
_LAST_NS = 2**63
_SAME_NS = 1_000_000
"""Times this near are one and the same, written with other digits."""
_GAP_NS = 100_000_000
"""Rows this near have a straight way between them."""


@dataclass(frozen=True)
class Table:
    """The poses of a table.

    Attributes:
        rows: In the order of the file.
        pose_of: Reads the pose of a row.
        conventions: How the table writes poses.
    """

    rows: Sequence[Row]
    pose_of: Callable[[Row], PlacedPose]
    conventions: PoseConventions

    def station(self, name: str, row: Row, image: ImageFile) -> RecordedStation:
        """Return the station of a row and its picture.

        Raises:
            InputError: The row holds no pose.
        """
        return recorded(name, self.pose_of(row), image, self.conventions)

    def station_between(
        self, name: str, start: Row, end: Row, share: float, image: ImageFile
    ) -> RecordedStation:
        """Return the station of a picture that was taken on the way from one row to the next.

        Raises:
            InputError: One of the rows holds no pose.
        """
        (first, written), (last, its) = (
            robot_pose(self.pose_of(row), self.conventions) for row in (start, end)
        )
        pose = between(first, last, np.array(share))
        return RecordedStation(name, pose, image, written_between(written, its, share, pose))


@dataclass(frozen=True)
class Pairs:
    """Images with the poses that belong to them.

    Attributes:
        stations: One for each image with a pose, in the order of the images.
        lone: The images without one.
        called: What images would be called by, for people.
    """

    stations: tuple[RecordedStation, ...]
    lone: tuple[ImageFile, ...]
    called: str


def by_key(table: Table, images: Sequence[ImageFile]) -> Pairs:
    """Pair images with rows by name; or, where no name is an image's, by the last number in both.

    Args:
        table: With a column `key`.
        images: Called by these keys.

    Raises:
        InputError: Two rows have one key, two images belong to one row, or a pose is none.
    """
    keys = [row.cells["key"] for row in table.rows]
    name_of: Callable[[str], str] = str
    if not set(keys) & {_stem(image) for image in images}:
        name_of = _number
    rows = _unique(table.rows, name_of)
    found = [rows.get(name_of(_stem(image))) for image in images]
    _require_one_image(images, found)
    stations = tuple(
        table.station(_stem(image), row, image)
        for image, row in zip(images, found, strict=True)
        if row is not None
    )
    lone = tuple(image for image, row in zip(images, found, strict=True) if row is None)
    return Pairs(stations, lone, f"names or numbers, such as {keys[0]}")


def by_time(table: Table, images: Sequence[ImageFile]) -> Pairs:
    """Pair images with poses by time, between two rows where none has just the image's.

    Args:
        table: With a column `time`.
        images: Called by their times.

    Raises:
        InputError: A time is no number, times do not increase, or a pose is none.
    """
    times = np.array([_row_time(row) for row in table.rows], dtype=np.int64)
    _require_increasing(times, table.rows)
    found = [_at_time(table, times, image) for image in images]
    first, last = (table.rows[index].cells["time"] for index in (0, -1))
    return Pairs(
        stations=tuple(station for station in found if station is not None),
        lone=tuple(image for image, each in zip(images, found, strict=True) if each is None),
        called=f"timestamps, {first} to {last}",
    )


def _at_time(table: Table, times: IntArray, image: ImageFile) -> RecordedStation | None:
    time = _time(_stem(image))
    if time is None:
        return None
    after = int(np.searchsorted(times, time))
    near = [index for index in (after - 1, after) if 0 <= index < len(times)]
    nearest = min(near, key=lambda index: abs(int(times[index]) - time))
    if abs(int(times[nearest]) - time) <= _SAME_NS:
        return table.station(_stem(image), table.rows[nearest], image)
    if len(near) < 2 or int(times[after] - times[after - 1]) > _GAP_NS:
        return None
    start, end = (table.rows[index] for index in near)
    share = (time - int(times[after - 1])) / int(times[after] - times[after - 1])
    return table.station_between(_stem(image), start, end, share, image)


def _stem(image: ImageFile) -> str:
    return PurePath(image.label).stem


def _number(name: str) -> str:
    """Return the last whole number in a name without leading zeros, or the name without one."""
    numbers = _WHOLE.findall(name)
    return str(int(numbers[-1])) if numbers else name


def _unique(rows: Sequence[Row], name_of: Callable[[str], str]) -> Mapping[str, Row]:
    found: dict[str, Row] = {}
    for row in rows:
        first = found.setdefault(name_of(row.cells["key"]), row)
        if first is not row:
            raise InputError(
                "expected every pose to have a name or number of its own, found "
                f"{row.cells['key']!r} after {first.cells['key']!r}",
                where=str(row.place),
            )
    return found


def _require_one_image(images: Sequence[ImageFile], found: Sequence[Row | None]) -> None:
    taken: dict[int, ImageFile] = {}
    for image, row in zip(images, found, strict=True):
        first = image if row is None else taken.setdefault(id(row), image)
        if row is not None and first is not image:
            raise InputError(
                f"expected one image for this pose, found {first.label} and {image.label}",
                where=str(row.place),
                hint="leave the images of one camera in the folder",
            )


def require_one_pose(images: Sequence[ImageFile], rows: Sequence[Row]) -> None:
    """Check that no image belongs to two poses.

    Args:
        images: Those that the rows name.
        rows: In the same order.

    Raises:
        InputError: Two rows name the same file.
    """
    first: dict[Path, Row] = {}
    for image, row in zip(images, rows, strict=True):
        other = first.setdefault(image.path, row)
        if other is not row:
            raise InputError(
                f"expected one pose for each image, found {row.cells['image']!r} after "
                f"{other.cells['image']!r}, which is the same file",
                where=str(row.place.key("image")),
            )


def _row_time(row: Row) -> int:
    time = _time(row.cells["time"])
    if time is None:
        raise InputError(
            f"expected a time in seconds or nanoseconds, found {row.cells['time']!r}",
            where=str(row.place.key("time")),
        )
    return time


def _time(text: str) -> int | None:
    """Return a time in nanoseconds, or None where the text is none."""
    try:
        time = Decimal(text)
    except InvalidOperation:
        return None
    if not time.is_finite() or not 0 <= time < _LAST_NS:
        return None
    nanoseconds = int(time if time >= _NANOSECONDS else time.scaleb(9))
    return nanoseconds if nanoseconds < _LAST_NS else None


def _require_increasing(times: IntArray, rows: Sequence[Row]) -> None:
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        before, after = (rows[int(back[0]) + step] for step in (0, 1))
        raise InputError(
            f"expected times that increase, found {after.cells['time']} after "
            f"{before.cells['time']}",
            where=str(after.place),
        )
