"""Data sets of industrial_calibration and robot_cal_tools (ROS-Industrial).

`cal_data.yaml` of industrial_calibration has under `data` a list of `image` and `pose`, both paths
relative to it, and beside it `static_camera`, `intrinsics` and `target_finder`; in robot_cal_tools
the file is that list alone. A pose file has x y z in metres and qx qy qz qw: the pose of the wrist
in the base, `base_T_gripper`, whichever of camera and target the wrist carries.

The intrinsics have no distortion, for their images are meant to be rectified, and no image size,
which the first image tells.
"""

from __future__ import annotations

from typing import Any

from handeye_cli.conventions import Setup
from handeye_cli.documents.cameras.intrinsics import focal_lengths
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.imports.fields import entries, mapping, numbers_of, value_of, words
from handeye_cli.documents.imports.foreign import Foreign, ImportOptions
from handeye_cli.documents.imports.pictures import names_of, picture
from handeye_cli.documents.imports.pose_pairs import PlacedPose, recorded
from handeye_cli.documents.imports.target_finder import target_of
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import (
    Camera,
    Finding,
    ImageSource,
    RecordedStation,
    Recording,
    TargetSpec,
)

_RECTIFIED = Finding(
    "no-distortion",
    "info",
    "the intrinsics of industrial_calibration have no distortion, as its images are meant to be "
    "rectified",
    "if yours are not, import with --camera FILE, or with --no-camera and let solve estimate them "
    "with --calibrate-intrinsics",
)


def recognises(foreign: Foreign) -> bool:
    """Return whether a file is a list of images and pose files, or has one under `data`."""
    data = foreign.data
    rows = data.get("data") if isinstance(data, dict) else data
    if not isinstance(rows, list) or not rows or not isinstance(rows[0], dict):
        return False
    return all(isinstance(rows[0].get(key), str) for key in ("image", "pose"))


def read(foreign: Foreign, options: ImportOptions) -> Recording:
    """Return the recording of a data set.

    Raises:
        InputError: The file is none, a pose or an image is missing, or neither it nor a flag says
            what the target is and where the camera is fixed.
    """
    data, place = foreign.parse(foreign.name), foreign.place
    config: dict[str, Any] = {} if isinstance(data, list) else mapping(data, place)
    rows = data if isinstance(data, list) else value_of(config, "data", place)
    setup = options.known_setup(_told_setup(config, place), place)
    target = options.target or _told_target(config, place)
    stations = _stations(foreign, rows, place if rows is data else place.key("data"), options)
    camera = None if options.own_camera else _camera(config, stations[0].image, place)
    findings = () if camera is None else (_RECTIFIED,)
    return Recording(setup, stations, target, camera, findings=findings)


def _told_setup(config: dict[str, Any], place: Place) -> Setup | None:
    if "static_camera" not in config:
        return None
    static = config["static_camera"]
    if not isinstance(static, bool):
        raise InputError(
            f"expected true or false, found {describe(static)}",
            where=str(place.key("static_camera")),
        )
    return Setup.EYE_TO_HAND if static else Setup.EYE_IN_HAND


def _told_target(config: dict[str, Any], place: Place) -> TargetSpec | None:
    if "target_finder" not in config:
        return None
    return target_of(config["target_finder"], place.key("target_finder"))


def _stations(
    foreign: Foreign, rows: Any, place: Place, options: ImportOptions
) -> tuple[RecordedStation, ...]:
    listed = [(row, place.item(index)) for index, row in enumerate(entries(rows, place))]
    images = [
        picture(_path(foreign, row, "image", at), options, at.key("image")) for row, at in listed
    ]
    poses = [_pose(foreign, _path(foreign, row, "pose", at)) for row, at in listed]
    conventions = options.conventions()
    return tuple(
        recorded(name, pose, image, conventions)
        for name, pose, image in zip(names_of(images), poses, images, strict=True)
    )


def _path(foreign: Foreign, row: Any, key: str, place: Place) -> str:
    return foreign.beside(words(value_of(row, key, place), place.key(key)))


def _pose(foreign: Foreign, name: str) -> PlacedPose:
    data, place = foreign.parse(name), Place(name)
    pose = {
        "translation": numbers_of(data, "xyz", place),
        "quaternion": numbers_of(data, ("qx", "qy", "qz", "qw"), place),
    }
    return PlacedPose(pose, place)


def _camera(config: dict[str, Any], image: ImageSource, place: Place) -> Camera | None:
    if "intrinsics" not in config:
        return None
    place = place.key("intrinsics")
    fx, fy, cx, cy = numbers_of(config["intrinsics"], ("fx", "fy", "cx", "cy"), place)
    focal_lengths((fx, fy), place)
    height, width = image.load().shape
    return Camera(width, height, fx, fy, cx, cy)
