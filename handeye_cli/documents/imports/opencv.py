"""Poses named as the arguments of OpenCV's `calibrateHandEye`, in JSON, YAML or NPZ.

Four lists of one length, `R_gripper2base`, `t_gripper2base`, `R_target2cam` and `t_target2cam`; or
a list of samples with these four keys, alone or under `samples`. Upper and lower case are the same.
A rotation is a 3x3 matrix or a rotation vector, a translation three numbers, in any nesting.

`a2b` is the pose of a in b: `gripper2base` is `base_T_gripper`, `target2cam` is `camera_T_target`,
and `base2gripper` the inverse of the former. For a camera beside the robot OpenCV wants that
inverse in the place of `gripper2base`, so some scripts save it under that name; it is taken by its
name here, and a finding says so. Such files do not say where the camera is fixed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from handeye_cli.conventions import RobotPoses, Setup
from handeye_cli.documents.cameras.intrinsics import elements, exactly, numbers
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.imports.fields import entries, mapping
from handeye_cli.documents.imports.foreign import Foreign, ImportOptions
from handeye_cli.documents.imports.npz import arrays_of, is_npz
from handeye_cli.documents.imports.pose_pairs import PlacedPose, from_rows, station
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Finding, Stations

_TARGET = ("R_target2cam", "t_target2cam")
_ROBOTS = {
    RobotPoses.GRIPPER_IN_BASE: ("R_gripper2base", "t_gripper2base"),
    RobotPoses.BASE_IN_GRIPPER: ("R_base2gripper", "t_base2gripper"),
}
_AS_NAMED = Finding(
    "gripper2base-as-named",
    "info",
    "gripper2base was taken for what it is called, the gripper's pose in the base; OpenCV's recipe "
    "for a camera beside the robot passes the inverse under this name",
    "if the file was made for that recipe, import it with --robot-poses base-in-gripper",
)


@dataclass(frozen=True)
class _Value:
    """What stands under a key, and where."""

    key: str
    value: Any
    place: Place


_Sample = Mapping[str, _Value]
"""The values of a sample, or of the lists of all, by their keys in lower case."""


def recognises(foreign: Foreign) -> bool:
    """Return whether a file has OpenCV's names, for lists or for each sample."""
    try:
        return _is_named(_first(_data(foreign)))
    except InputError:
        return False


def read(foreign: Foreign, options: ImportOptions) -> Stations:
    """Return the stations of a file.

    Raises:
        InputError: It has not all four names, lists of several lengths, something that is no pose,
            or nothing says where the camera is fixed.
    """
    samples = _samples(_data(foreign), foreign.place)
    setup = options.known_setup(None, foreign.place)
    told = _direction(*samples[0])
    conventions = options.conventions(told)
    stations = tuple(
        station(
            f"{index:02d}",
            _pose(sample, _ROBOTS[told], place),
            _pose(sample, _TARGET, place),
            conventions,
        )
        for index, (sample, place) in enumerate(samples)
    )
    doubtful = setup is Setup.EYE_TO_HAND and told is RobotPoses.GRIPPER_IN_BASE
    findings = (_AS_NAMED,) if doubtful and options.robot_poses is None else ()
    return Stations(setup, stations, target=options.target, findings=findings)


def _data(foreign: Foreign) -> Any:
    if is_npz(foreign.content):
        return arrays_of(foreign.content, foreign.name)
    return foreign.parse(foreign.name)


def _first(data: Any) -> Any:
    """Return the mapping that OpenCV's names stand in, if they do."""
    if isinstance(data, dict) and "samples" in data:
        data = data["samples"]
    return data[0] if isinstance(data, list) and data else data


def _is_named(data: Any) -> bool:
    known = {key.lower() for key in data} if isinstance(data, dict) else set()
    return {key.lower() for key in _TARGET} <= known


def _samples(data: Any, place: Place) -> list[tuple[_Sample, Place]]:
    """Return every sample, and where it stands."""
    if isinstance(data, dict) and "samples" in data:
        data, place = data["samples"], place.key("samples")
    if isinstance(data, list):
        places = [place.item(index) for index in range(len(entries(data, place)))]
        return [(_sample(item, at), at) for item, at in zip(data, places, strict=True)]
    columns = _sample(data, place)
    wanted = [key.lower() for key in (*_ROBOTS[_direction(columns, place)], *_TARGET)]
    count = _one_length([columns[key] for key in wanted])
    return [({key: _entry(columns[key], index) for key in wanted}, place) for index in range(count)]


def _sample(data: Any, place: Place) -> _Sample:
    inside = mapping(data, place)
    return {key.lower(): _Value(key, value, place.key(key)) for key, value in inside.items()}


def _entry(column: _Value, index: int) -> _Value:
    return _Value(column.key, column.value[index], column.place.item(index))


def _one_length(columns: Sequence[_Value]) -> int:
    """Return how many entries all lists have."""
    first, *others = columns
    count = len(entries(first.value, first.place))
    for each in others:
        found = len(entries(each.value, each.place))
        if found != count:
            raise InputError(
                f"expected {count} entries as in {first.key}, found {found}", where=str(each.place)
            )
    return count


def _direction(sample: _Sample, place: Place) -> RobotPoses:
    """Return which way round the robot's poses are, by their names."""
    told = next((way for way, keys in _ROBOTS.items() if _has(sample, keys)), None)
    if told is None or not _has(sample, _TARGET):
        raise _incomplete(sample, place)
    return told


def _has(sample: _Sample, keys: tuple[str, str]) -> bool:
    return all(key.lower() in sample for key in keys)


def _pose(sample: _Sample, keys: tuple[str, str], place: Place) -> PlacedPose:
    if not _has(sample, keys):
        raise _incomplete(sample, place)
    rotation, translation = (sample[key.lower()] for key in keys)
    t = exactly(3, elements(translation.value), translation.place)
    R = numbers(elements(rotation.value), rotation.place)
    if len(R) == 3:
        return PlacedPose({"translation": t, "rotvec": R}, rotation.place)
    if len(R) != 9:
        raise InputError(
            f"expected a 3x3 matrix or a rotation vector, found {len(R)} numbers",
            where=str(rotation.place),
        )
    rows = [*R[:3], t[0], *R[3:6], t[1], *R[6:], t[2], 0.0, 0.0, 0.0, 1.0]
    return from_rows(rows, rotation.place)


def _incomplete(sample: _Sample, place: Place) -> InputError:
    return InputError(
        "expected the keys R_gripper2base, t_gripper2base, R_target2cam and t_target2cam, found "
        f"{describe({each.key: None for each in sample.values()})}",
        where=str(place),
        hint="rename the keys: gripper2base is the gripper's pose in the base, target2cam the "
        "target's in the camera",
    )
