"""Samples of MoveIt Calibration: poses that its RViz panel saves.

The YAML file is a list of `effector_wrt_world`, which is `base_T_gripper`, and `object_wrt_sensor`,
which is `camera_T_target`, each the 16 numbers of a 4x4 matrix row by row, in metres. An older JSON
form, that of its solvers' tests, is a list of pairs of 4x4 matrices in the same order. Neither says
where the camera is fixed.
"""

from __future__ import annotations

from typing import Any

from handeye_cli.documents.cameras.intrinsics import exactly
from handeye_cli.documents.imports.fields import entries, value_of
from handeye_cli.documents.imports.foreign import Foreign, ImportOptions
from handeye_cli.documents.imports.pose_pairs import PlacedPose, from_rows, station
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Stations

_KEYS = ("effector_wrt_world", "object_wrt_sensor")


def recognises(foreign: Foreign) -> bool:
    """Return whether a file is a list of samples, or of pairs of matrices."""
    data = foreign.data
    if not isinstance(data, list) or not data:
        return False
    first = data[0]
    return _is_pair(first) or (isinstance(first, dict) and first.keys() >= set(_KEYS))


def read(foreign: Foreign, options: ImportOptions) -> Stations:
    """Return the stations of a list of samples.

    Raises:
        InputError: It is none, a matrix is no pose, or nothing says where the camera is fixed.
    """
    place, conventions = foreign.place, options.conventions()
    samples = entries(foreign.parse(foreign.name), place)
    setup = options.known_setup(None, place)
    stations = tuple(
        station(f"{index:02d}", *_poses(sample, place.item(index)), conventions)
        for index, sample in enumerate(samples)
    )
    return Stations(setup, stations, target=options.target)


def _poses(sample: Any, place: Place) -> tuple[PlacedPose, PlacedPose]:
    if isinstance(sample, list):
        if len(sample) != 2:
            message = f"expected a pair of matrices, found a list of {len(sample)}"
            raise InputError(message, where=str(place))
        robot, target = ((sample[index], place.item(index)) for index in (0, 1))
    else:
        robot, target = ((value_of(sample, key, place), place.key(key)) for key in _KEYS)
    return _matrix(*robot), _matrix(*target)


def _matrix(value: Any, place: Place) -> PlacedPose:
    return from_rows(exactly(16, value, place), place)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_square, value))


def _is_square(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 4
        and all(isinstance(row, list) and len(row) == 4 for row in value)
    )
