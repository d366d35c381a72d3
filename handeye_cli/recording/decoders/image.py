"""`sensor_msgs/Image`."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.messages import ImageMessage

DEFINITION = ros.definition(
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
    "uint8 is_bigendian\nuint32 step\nuint8[] data\n",
    ros.HEADER,
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Any) -> ImageMessage:
    """Return a decoded ROS message as ours."""
    return ImageMessage(
        header=ros.decode_header(message.header),
        height=message.height,
        width=message.width,
        encoding=message.encoding,
        is_bigendian=bool(message.is_bigendian),
        step=message.step,
        data=bytes(message.data),
    )
