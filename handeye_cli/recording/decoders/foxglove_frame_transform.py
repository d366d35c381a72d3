"""`foxglove.FrameTransform`."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import Header, TransformsMessage, TransformStamped

DEFINITION = ros.definition(foxglove.FRAME_TRANSFORM, foxglove.FRAME_TRANSFORM_PARTS)
"""Its fields in the order of ROS, and of protobuf."""


def decode(message: Values) -> TransformsMessage:
    """Return a decoded message as ours."""
    return TransformsMessage((decode_transform(message),), lasting=True)


def decode_transform(message: Values) -> TransformStamped:
    """Return one decoded transform as ours."""
    return TransformStamped(
        header=Header(message["timestamp"], message["parent_frame_id"]),
        child_frame_id=message["child_frame_id"],
        translation=ros.decode_vector(message["translation"]),
        rotation=ros.decode_quaternion(message["rotation"]),
    )
