"""The pose in a row of a table: a quaternion by its columns, or angles by what the user says."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from handeye_cli.documents.imports.pose_pairs import PlacedPose
from handeye_cli.documents.imports.table import Row
from handeye_cli.errors import InputError, UsageError

_QUATERNION = ("qx", "qy", "qz", "qw")
_ANGLES = ("rx", "ry", "rz")
_ROTATION = re.compile(r"rotvec|([xyz]{3}|[XYZ]{3})(:deg)?")

PoseOf = Callable[[Row], PlacedPose]
"""What reads the pose of a row."""


def reader(row: Row, rotation: str | None) -> PoseOf:
    """Return what reads the poses of a table.

    Args:
        row: One of its rows.
        rotation: What the columns rx, ry, rz are: `rotvec` (radians), or the axes of Euler angles
            as our documents name them, with `:deg` for degrees.

    Raises:
        InputError: The table has neither a quaternion nor three angles, or the angles may be
            several things.
        UsageError: `rotation` is not written so, or has no angles to act on.
    """
    if all(column in row.cells for column in _QUATERNION):
        if rotation is not None:
            raise UsageError(
                "--rotation acts on columns rx, ry, rz, and the table has quaternions",
                hint="leave it out",
            )
        return _quaternion
    if not all(column in row.cells for column in _ANGLES):
        known = ", ".join(filter(None, row.cells))
        raise InputError(
            f"expected the columns qx, qy, qz, qw, or rx, ry, rz, found {known}",
            where=row.place.file.partition(", line")[0],
        )
    return _angles(rotation, row)


def _quaternion(row: Row) -> PlacedPose:
    data = {"translation": row.numbers("xyz"), "quaternion": row.numbers(_QUATERNION)}
    return PlacedPose(data, row.place)


def _angles(rotation: str | None, row: Row) -> PoseOf:
    if rotation is None:
        raise InputError(
            "expected to learn what the three angles rx, ry, rz are, found nothing that says so",
            where=row.place.file.partition(", line")[0],
            hint="say --rotation rotvec (radians, as of Universal Robots), or the axes of Euler "
            "angles, such as --rotation xyz:deg (about fixed axes) or ZYX:deg (axes turn along)",
        )
    match = _ROTATION.fullmatch(rotation)
    if match is None:
        raise UsageError(
            f"expected rotvec, or three axes such as xyz or ZYX:deg, found {rotation!r}",
            where="--rotation",
        )
    form = {"order": match[1], "degrees": match[2] is not None} if match[1] else None

    def pose(row: Row) -> PlacedPose:
        data: dict[str, Any] = {"translation": row.numbers("xyz")}
        data |= (
            {"rotvec": row.numbers(_ANGLES)}
            if form is None
            else {"euler": row.numbers(_ANGLES), **form}
        )
        return PlacedPose(data, row.place)

    return pose
