"""Samples of easy_handeye and easy_handeye2 (ROS).

easy_handeye2 saves `samples`, a list of `robot` and `tracking`, with `parameters` beside it; the
sample list of easy_handeye's services has two lists, `hand_world_samples` and
`camera_marker_samples`. A transform has a `translation` x y z in metres and a `rotation` x y z w.

`tracking` is `camera_T_target`. `robot` is `base_T_gripper` for a camera on the hand; for a camera
beside the robot both tools sample its inverse, so that their solver may take the two alike. The
calibration's type is empty in many files and has to be told then.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from handeye_cli.conventions import RobotPoses, Setup
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.imports.fields import entries, mapping, numbers_of, value_of
from handeye_cli.documents.imports.foreign import Foreign, ImportOptions
from handeye_cli.documents.imports.pose_pairs import PlacedPose, station
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Stations

_SETUPS = {
    "eye_in_hand": Setup.EYE_IN_HAND,
    "eye_on_hand": Setup.EYE_IN_HAND,
    "eye_on_base": Setup.EYE_TO_HAND,
    "eye_to_hand": Setup.EYE_TO_HAND,
}
_DIRECTIONS = {
    Setup.EYE_IN_HAND: RobotPoses.GRIPPER_IN_BASE,
    Setup.EYE_TO_HAND: RobotPoses.BASE_IN_GRIPPER,
}
_LISTS = ("hand_world_samples", "camera_marker_samples")


def recognises(foreign: Foreign) -> bool:
    """Return whether a file has the keys of a sample list."""
    data = foreign.data
    if not isinstance(data, dict):
        return False
    samples = data.get("samples")
    if isinstance(samples, list) and samples and isinstance(samples[0], dict):
        return {"robot", "tracking"} <= samples[0].keys()
    return _has_lists(samples) or _has_lists(data)


def read(foreign: Foreign, options: ImportOptions) -> Stations:
    """Return the stations of a sample list.

    Raises:
        InputError: It is none, a transform is none, or nothing says where the camera is fixed.
    """
    data = mapping(foreign.parse(foreign.name), foreign.place)
    setup = options.known_setup(_told_setup(data, foreign.place), foreign.place)
    conventions = options.conventions(_DIRECTIONS[setup])
    stations = tuple(
        station(f"{index:02d}", robot, target, conventions)
        for index, (robot, target) in enumerate(_pairs(data, foreign.place))
    )
    return Stations(setup, stations, target=options.target)


def _told_setup(data: dict[str, Any], place: Place) -> Setup | None:
    parameters, place = data.get("parameters"), place.key("parameters")
    if not isinstance(parameters, dict):
        return None
    if isinstance(parameters.get("eye_on_hand"), bool):
        return Setup.EYE_IN_HAND if parameters["eye_on_hand"] else Setup.EYE_TO_HAND
    told = parameters.get("calibration_type") or None
    if told is not None and (not isinstance(told, str) or told not in _SETUPS):
        raise InputError(
            f"expected one of {', '.join(_SETUPS)}, found {describe(told)}",
            where=str(place.key("calibration_type")),
        )
    return None if told is None else _SETUPS[told]


def _pairs(data: dict[str, Any], place: Place) -> Iterator[tuple[PlacedPose, PlacedPose]]:
    if _has_lists(data):
        return _paired_lists(data, place)
    samples, place = value_of(data, "samples", place), place.key("samples")
    return _paired_lists(samples, place) if _has_lists(samples) else _paired(samples, place)


def _paired(samples: Any, place: Place) -> Iterator[tuple[PlacedPose, PlacedPose]]:
    for index, sample in enumerate(entries(samples, place)):
        at = place.item(index)
        robot, target = (value_of(sample, key, at) for key in ("robot", "tracking"))
        yield _transform(robot, at.key("robot")), _transform(target, at.key("tracking"))


def _paired_lists(data: dict[str, Any], place: Place) -> Iterator[tuple[PlacedPose, PlacedPose]]:
    robots, targets = (_transforms(data[key], place.key(key)) for key in _LISTS)
    if len(robots) != len(targets):
        raise InputError(
            f"expected as many camera_marker_samples as hand_world_samples ({len(robots)}), "
            f"found {len(targets)}",
            where=str(place.key(_LISTS[1])),
        )
    return zip(robots, targets, strict=True)


def _has_lists(data: Any) -> bool:
    return isinstance(data, dict) and data.keys() >= set(_LISTS)


def _transforms(value: Any, place: Place) -> list[PlacedPose]:
    """Return the transforms of a list, or of the message around it that early versions have."""
    if isinstance(value, dict):
        value, place = value_of(value, "transforms", place), place.key("transforms")
    return [_transform(each, place.item(index)) for index, each in enumerate(entries(value, place))]


def _transform(data: Any, place: Place) -> PlacedPose:
    translation, rotation = (value_of(data, key, place) for key in ("translation", "rotation"))
    pose = {
        "translation": numbers_of(translation, "xyz", place.key("translation")),
        "quaternion": numbers_of(rotation, "xyzw", place.key("rotation")),
    }
    return PlacedPose(pose, place)
