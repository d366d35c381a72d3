"""The calibration file of easy_handeye2 (ROS 2): its message `HandeyeCalibration` as YAML."""

from __future__ import annotations

from handeye_cli.conventions import Setup
from handeye_cli.documents import layout
from handeye_cli.documents.exports.easy_handeye import robot_frames
from handeye_cli.documents.exports.numbers import quaternion_of, translation_of
from handeye_cli.records.named_transform import NamedTransform

_TYPES = {Setup.EYE_IN_HAND: "eye_in_hand", Setup.EYE_TO_HAND: "eye_on_base"}


def text(transform: NamedTransform) -> str:
    """Return the file, `NAME.calib` in `~/.ros2/easy_handeye2/calibrations`."""
    parameters = {
        "name": transform.name,
        "calibration_type": _TYPES[transform.setup],
        **robot_frames(transform),
        "tracking_base_frame": transform.child,
        "tracking_marker_frame": "",
        "freehand_robot_movement": True,
        "move_group_namespace": "/",
        "move_group": "manipulator",
    }
    pose = {
        "translation": dict(zip("xyz", translation_of(transform.matrix), strict=True)),
        "rotation": dict(zip("xyzw", quaternion_of(transform.matrix), strict=True)),
    }
    return layout.dump({"parameters": parameters, "transform": pose}, "yaml")
