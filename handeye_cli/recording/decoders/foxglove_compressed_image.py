"""`foxglove.CompressedImage`."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.decoders.foxglove import HEAD_FIELDS, decode_head
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import CompressedImageMessage

__all__ = ["DEFINITION", "HEAD_FIELDS", "NUMBERS", "decode", "decode_head"]

DEFINITION = ros.definition(foxglove.HEAD + "uint8[] data\nstring format\n", {})
"""Its fields in the order of ROS."""
NUMBERS = {"frame_id": 4, "data": 2, "format": 3}
"""Numbers of its fields in protobuf where they are not in this order."""


def decode(message: Values) -> CompressedImageMessage:
    """Return a decoded message as ours."""
    return CompressedImageMessage(decode_head(message), message["format"], message["data"])
