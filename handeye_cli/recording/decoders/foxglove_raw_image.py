"""`foxglove.RawImage`."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.decoders.foxglove import HEAD_FIELDS, decode_head
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import ImageMessage

__all__ = ["DEFINITION", "HEAD_FIELDS", "NUMBERS", "decode", "decode_head"]

DEFINITION = ros.definition(
    foxglove.HEAD + "uint32 width\nuint32 height\nstring encoding\nuint32 step\nuint8[] data\n",
    {},
)
"""Its fields in the order of ROS."""
NUMBERS = {"frame_id": 7, "width": 2, "height": 3, "encoding": 4, "step": 5, "data": 6}
"""Numbers of its fields in protobuf where they are not in this order."""


def decode(message: Values) -> ImageMessage:
    """Return a decoded message as ours; its wide pixels are always little-endian."""
    return ImageMessage(
        header=decode_head(message),
        height=message["height"],
        width=message["width"],
        encoding=message["encoding"],
        is_bigendian=False,
        step=message["step"],
        data=message["data"],
    )
