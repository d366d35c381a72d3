"""The calibration file of easy_handeye (ROS 1), which its publisher looks for by its namespace."""

from __future__ import annotations

import re

from handeye_cli.conventions import Setup
from handeye_cli.documents import layout
from handeye_cli.documents.exports.numbers import quaternion_of, translation_of
from handeye_cli.errors import UsageError
from handeye_cli.records.named_transform import NamedTransform

_KEYS = ("x", "y", "z", "qx", "qy", "qz", "qw")
_NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def text(transform: NamedTransform) -> str:
    """Return the file, which belongs into `~/.ros/easy_handeye` under the name it was given.

    Raises:
        UsageError: That name cannot be a namespace of ROS.
    """
    if not _NAMESPACE.fullmatch(transform.name):
        raise UsageError(
            "expected a file name of letters, digits and _, which is the namespace of the "
            f"calibration, found {transform.name!r}",
            hint="name it as the publisher looks for it, such as my_robot_eye_on_hand.yaml",
        )
    numbers = [*translation_of(transform.matrix), *quaternion_of(transform.matrix)]
    parameters = {
        "namespace": f"/{transform.name}/",
        "eye_on_hand": transform.setup is Setup.EYE_IN_HAND,
        **robot_frames(transform),
        "tracking_base_frame": transform.child,
        "tracking_marker_frame": "",
        "move_group_namespace": "/",
        "move_group": "manipulator",
    }
    transformation = dict(zip(_KEYS, numbers, strict=True))
    return layout.dump({"parameters": parameters, "transformation": transformation}, "yaml")


def robot_frames(transform: NamedTransform) -> dict[str, str]:
    """Return the frames of the robot; the one that has no part in the transform is left empty."""
    in_hand = transform.setup is Setup.EYE_IN_HAND
    return {
        "robot_base_frame": "" if in_hand else transform.parent,
        "robot_effector_frame": transform.parent if in_hand else "",
    }
