"""Folders of ViSP's hand-eye calibration: numbered poses, images and `camera.xml`.

`pose_rPe_N.yaml` (older: `pose_fPe_N.yaml`) is the pose of the effector in the robot's reference
frame, `base_T_gripper`, for cameras on the hand and beside the robot alike; `pose_cPo_N.yaml` is
that of the object in the camera, `camera_T_target`. Both have six numbers under `data`: a
translation in metres and the vector theta u in radians. Images are `image-N.png`. Any name may
have a prefix such as `franka_`; the numbers N tell what belongs together.

With poses cPo the folder gives stations, and a robot pose without one is a station whose target
was not found; without any, images and robot poses give a recording. Neither says where the camera
is fixed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from handeye_cli.documents.cameras.intrinsics import exactly
from handeye_cli.documents.imports import visp_camera
from handeye_cli.documents.imports.fields import value_of
from handeye_cli.documents.imports.foreign import Foreign, ImportOptions
from handeye_cli.documents.imports.pictures import picture
from handeye_cli.documents.imports.pose_pairs import PlacedPose, recorded, station, unseen
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Camera, RecordedStation, Recording, Station, Stations

_ROBOT = re.compile(r"(.*pose_[rf]Pe)_([0-9]{1,9})\.ya?ml")
_TARGET = re.compile(r"(.*pose_cPo)_([0-9]{1,9})\.ya?ml")
_IMAGE = re.compile(r"(.*image)[-_]([0-9]{1,9})\.(?:png|jpe?g|tiff?|bmp|p[gp]m)", re.IGNORECASE)
_CAMERA = re.compile(r".*camera\.xml")

_Numbered = Mapping[int, str]
"""Paths of files by their numbers, in their order."""


def recognises(foreign: Foreign) -> bool:
    """Return whether a folder has numbered poses of a robot."""
    return any(_ROBOT.fullmatch(name) for name in foreign.entries)


def read(foreign: Foreign, options: ImportOptions) -> Recording | Stations:
    """Return the stations of a folder, or its recording where no pose of the target is in it.

    Raises:
        InputError: Files do not belong together, a pose is none, or nothing says where the camera
            is fixed.
    """
    robots, targets = _numbered(foreign, _ROBOT), _numbered(foreign, _TARGET)
    if not robots:
        raise InputError(
            "expected a folder with poses of the robot, pose_rPe_1.yaml, ..., found none",
            where=foreign.name,
        )
    setup = options.known_setup(None, foreign.place)
    camera = None if options.own_camera else _camera(foreign)
    if not targets:
        return Recording(setup, _recorded(foreign, robots, options), options.target, camera)
    _require_among(targets, robots, "a pose of the robot")
    stations = tuple(_station(foreign, robots, targets, index, options) for index in robots)
    return Stations(setup, stations, options.target, camera)


def _recorded(
    foreign: Foreign, robots: _Numbered, options: ImportOptions
) -> tuple[RecordedStation, ...]:
    images = _numbered(foreign, _IMAGE)
    if not images:
        raise InputError(
            "expected poses of the target, pose_cPo_1.yaml, ..., or images, image-1.png, ..., "
            "beside those of the robot, found neither",
            where=foreign.name,
        )
    _require_among(images, robots, "a pose of the robot")
    _require_among(robots, images, "an image")
    conventions = options.conventions()
    return tuple(
        recorded(
            str(index),
            _pose(foreign, path),
            picture(images[index], options, foreign.place),
            conventions,
        )
        for index, path in robots.items()
    )


def _station(
    foreign: Foreign, robots: _Numbered, targets: _Numbered, index: int, options: ImportOptions
) -> Station:
    robot, conventions = _pose(foreign, robots[index]), options.conventions()
    if index not in targets:
        reason = f"ViSP found no pose of the target: there is no pose_cPo_{index}.yaml"
        return unseen(str(index), robot, reason, conventions)
    return station(str(index), robot, _pose(foreign, targets[index]), conventions)


def _pose(foreign: Foreign, name: str) -> PlacedPose:
    place = Place(name)
    numbers = exactly(6, value_of(foreign.parse(name), "data", place), place.key("data"))
    return PlacedPose({"translation": numbers[:3], "rotvec": numbers[3:]}, place)


def _camera(foreign: Foreign) -> Camera | None:
    names = [name for name in foreign.entries if _CAMERA.fullmatch(name)]
    if len(names) > 1:
        raise InputError(
            f"expected one file of intrinsics, found {', '.join(names)}",
            where=foreign.name,
            hint="take the others out, or leave all aside with --no-camera",
        )
    path = foreign.beside(names[0]) if names else None
    return None if path is None else visp_camera.read(foreign.read(path), Place(path))


def _numbered(foreign: Foreign, pattern: re.Pattern[str]) -> _Numbered:
    """Return the files whose names match, by their numbers."""
    matches = [match for match in map(pattern.fullmatch, foreign.entries) if match]
    found: dict[int, str] = {}
    for match in sorted(matches, key=lambda match: int(match[2])):
        index, path = int(match[2]), foreign.beside(match[0])
        if found.setdefault(index, path) != path:
            raise InputError(
                f"expected one file of number {index}, found {found[index]} and {path}",
                where=foreign.name,
                hint="put every run into a folder of its own",
            )
    return found


def _require_among(some: _Numbered, others: _Numbered, what: str) -> None:
    lone = next((path for index, path in some.items() if index not in others), None)
    if lone is not None:
        raise InputError(
            f"expected {what} with the same number, found none",
            where=lone,
            hint="a file is missing, or this one is left over",
        )
