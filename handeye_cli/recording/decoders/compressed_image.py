"""`sensor_msgs/CompressedImage`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.decoders.ros import HEAD_FIELDS, decode_head
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import CompressedImageMessage

__all__ = ["DEFINITION", "HEAD_FIELDS", "decode", "decode_head"]

DEFINITION = ros.definition("std_msgs/Header header\nstring format\nuint8[] data\n", ros.HEADER)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> CompressedImageMessage:
    """Return a decoded message as ours."""
    return CompressedImageMessage(decode_head(message), message["format"], message["data"])
