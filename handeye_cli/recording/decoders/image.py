"""`sensor_msgs/Image`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.decoders.ros import HEAD_FIELDS, decode_head
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import ImageMessage

__all__ = ["DEFINITION", "HEAD_FIELDS", "decode", "decode_head"]

DEFINITION = ros.definition(
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
    "uint8 is_bigendian\nuint32 step\nuint8[] data\n",
    ros.HEADER,
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> ImageMessage:
    """Return a decoded message as ours."""
    return ImageMessage(
        header=decode_head(message),
        height=message["height"],
        width=message["width"],
        encoding=message["encoding"],
        is_bigendian=bool(message["is_bigendian"]),
        step=message["step"],
        data=message["data"],
    )
