"""`sensor_msgs/JointState`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import JointsMessage

DEFINITION = ros.definition(
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort\n",
    ros.HEADER,
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> JointsMessage:
    """Return a decoded message as ours; joints without a position are left out."""
    names, positions = message["name"], message["position"]
    return JointsMessage(ros.decode_head(message), tuple(zip(names, positions, strict=False)))
