"""`foxglove.FrameTransforms`."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.decoders.foxglove_frame_transform import decode_transform
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import TransformsMessage

DEFINITION = ros.definition(
    "foxglove_msgs/FrameTransform[] transforms\n",
    foxglove.FRAME_TRANSFORM_PARTS | {"foxglove_msgs/FrameTransform": foxglove.FRAME_TRANSFORM},
)
"""Its fields in the order of ROS, and of protobuf."""


def decode(message: Values) -> TransformsMessage:
    """Return a decoded message as ours."""
    transforms = tuple(decode_transform(each) for each in message["transforms"])
    return TransformsMessage(transforms, lasting=True)
