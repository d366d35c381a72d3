"""What Foxglove's messages share: their definitions in the order of ROS, time and frame.

Names are those in JSON; a field's number in protobuf is its place here unless a module's `NUMBERS`
says otherwise.
"""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import Header

HEAD = "builtin_interfaces/Time timestamp\nstring frame_id\n"
"""Lines of time and frame, with which most messages begin."""
HEAD_FIELDS = 2
"""Fields at the start of a message that say when and in which frame."""
FRAME_TRANSFORM = (
    "builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
)
"""Lines of a transform."""
FRAME_TRANSFORM_PARTS = ros.VECTOR | ros.QUATERNION
"""Definitions of a transform's parts."""


def decode_head(message: Values) -> Header:
    """Return time and frame of a message."""
    return Header(message["timestamp"], message["frame_id"])
