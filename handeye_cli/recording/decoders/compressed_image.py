"""`sensor_msgs/CompressedImage`."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.messages import CompressedImageMessage

DEFINITION = ros.definition("std_msgs/Header header\nstring format\nuint8[] data\n", ros.HEADER)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Any) -> CompressedImageMessage:
    """Return a decoded ROS message as ours."""
    return CompressedImageMessage(
        header=ros.decode_header(message.header), format=message.format, data=bytes(message.data)
    )
