"""`geometry_msgs/PoseStamped`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import PoseStamped

DEFINITION = ros.definition(
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n", ros.HEADER | ros.POSE
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> PoseStamped:
    """Return a decoded message as ours."""
    return PoseStamped(ros.decode_head(message), **ros.decode_pose(message["pose"]))
