"""`foxglove.PoseInFrame`."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import PoseStamped

DEFINITION = ros.definition(foxglove.HEAD + "geometry_msgs/Pose pose\n", ros.POSE)
"""Its fields in the order of ROS, and of protobuf."""


def decode(message: Values) -> PoseStamped:
    """Return a decoded message as ours."""
    return PoseStamped(foxglove.decode_head(message), **ros.decode_pose(message["pose"]))
