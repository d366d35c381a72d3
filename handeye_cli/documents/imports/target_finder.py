"""The target finders of industrial_calibration and robot_cal_tools as targets of ours.

Their type may carry a namespace and the word Plugin, and lengths are in metres. The frame of their
plate of discs begins at the larger disc too, but x runs along the row and y away from the edge,
with z out of the plate: with z into it, as here, columns and rows change places. This moves the
target's frame and not the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from handeye_cli.conventions import MM
from handeye_cli.documents.cameras.intrinsics import number
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.imports.fields import numbers_of, value_of, words
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import TargetSpec

_DICTIONARIES = (
    *(f"DICT_{side}X{side}_{count}" for side in (4, 5, 6, 7) for count in (50, 100, 250, 1000)),
    "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_16h5",
    "DICT_APRILTAG_25h9",
    "DICT_APRILTAG_36h10",
    "DICT_APRILTAG_36h11",
)
"""OpenCV's dictionaries by their numbers."""
_DEFAULT_DICTIONARY = 10
_DIGITS = 12
"""Significant digits that a length in metres keeps in millimetres."""


def target_of(data: Any, place: Place) -> TargetSpec:
    """Return the target that a finder looks for.

    Args:
        data: The mapping `target_finder`.
        place: Where it stands.

    Raises:
        InputError: Its type is unknown, a key is missing, or it leaves open what we need.
    """
    told = words(value_of(data, "type", place), place.key("type"))
    name = told.rpartition("::")[2].removesuffix("Plugin")
    if name not in _TARGETS:
        raise InputError(
            f"expected one of {', '.join(_TARGETS)}, found {told!r}",
            where=str(place.key("type")),
            hint="say what the target is with --target, such as chessboard:9x6:23.6mm",
        )
    rows, columns = (_count(data, key, place) for key in ("rows", "cols"))
    return _TARGETS[name](data, rows, columns, place)


def _disc_grid(data: Any, rows: int, columns: int, place: Place) -> TargetSpec:
    spacing = _millimetres(data, "spacing", place)
    raise InputError(
        f"expected the diameters of the discs, found their spacing of {spacing:g} mm alone",
        where=str(place),
        hint=f"measure them and say --target disc-grid:{rows}x{columns}:{spacing:g}mm:"
        "DIAMETER:CORNER_DIAMETER",
    )


def _charuco(data: Any, rows: int, columns: int, place: Place) -> TargetSpec:
    lengths = {
        "square_mm": _millimetres(data, "chessboard_dim", place),
        "marker_mm": _millimetres(data, "aruco_marker_dim", place),
    }
    return TargetSpec("charuco", _grid(rows, columns) | lengths | _dictionary(data, place))


def _aruco_grid(data: Any, rows: int, columns: int, place: Place) -> TargetSpec:
    lengths = {
        "size_mm": _millimetres(data, "aruco_marker_dim", place),
        "gap_mm": _millimetres(data, "marker_gap", place),
    }
    return TargetSpec("aruco-grid", _grid(rows, columns) | lengths | _dictionary(data, place))


_TARGETS: Mapping[str, Callable[[Any, int, int, Place], TargetSpec]] = {
    "ModifiedCircleGridTargetFinder": _disc_grid,
    "CharucoGridTargetFinder": _charuco,
    "ArucoGridTargetFinder": _aruco_grid,
}


def _grid(rows: int, columns: int) -> dict[str, Any]:
    return {"columns": columns, "rows": rows}


def _dictionary(data: Any, place: Place) -> dict[str, Any]:
    index = data.get("dictionary", _DEFAULT_DICTIONARY)
    if type(index) is not int or not 0 <= index < len(_DICTIONARIES):
        raise InputError(
            f"expected the number of one of OpenCV's dictionaries, 0 to {len(_DICTIONARIES) - 1}, "
            f"found {describe(index)}",
            where=str(place.key("dictionary")),
        )
    return {"dictionary": _DICTIONARIES[index]}


def _count(data: Any, key: str, place: Place) -> int:
    found = number(value_of(data, key, place), place.key(key))
    if found < 1.0 or found != int(found):
        raise InputError(
            f"expected a whole number above 0, found {found:g}", where=str(place.key(key))
        )
    return int(found)


def _millimetres(data: Any, key: str, place: Place) -> float:
    (metres,) = numbers_of(data, (key,), place)
    if metres <= 0.0:
        message = f"expected a length above 0 m, found {metres:g}"
        raise InputError(message, where=str(place.key(key)))
    return float(f"{metres / MM:.{_DIGITS}g}")
