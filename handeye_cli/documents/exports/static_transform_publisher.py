"""The command line of ROS 2's `tf2_ros static_transform_publisher`, in its form with flags.

Of the older forms without flags the one with angles wants yaw first; this one cannot be misread.
"""

from __future__ import annotations

import shlex

from handeye_cli.documents.exports.numbers import quaternion_of, translation_of, words
from handeye_cli.records.named_transform import NamedTransform

_FLAGS = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")


def text(transform: NamedTransform) -> str:
    """Return a line for a shell."""
    line = ["ros2", "run", "tf2_ros", "static_transform_publisher", *arguments(transform)]
    return f"{shlex.join(line)}\n"


def arguments(transform: NamedTransform) -> list[str]:
    """Return the arguments of the publisher: metres, quaternion x y z w, and the frames."""
    numbers = words([*translation_of(transform.matrix), *quaternion_of(transform.matrix)])
    pairs = zip(_FLAGS, numbers, strict=True)
    frames = ["--frame-id", transform.parent, "--child-frame-id", transform.child]
    return [*(word for pair in pairs for word in pair), *frames]
