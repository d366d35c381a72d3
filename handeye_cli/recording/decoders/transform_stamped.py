"""`geometry_msgs/TransformStamped`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import TransformsMessage, TransformStamped

DEFINITION = ros.definition(
    ros.TRANSFORM_STAMPED["geometry_msgs/TransformStamped"], ros.TRANSFORM_STAMPED
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> TransformsMessage:
    """Return a decoded message as ours."""
    return TransformsMessage((decode_transform(message),))


def decode_transform(message: Values) -> TransformStamped:
    """Return one decoded transform as ours."""
    return TransformStamped(
        header=ros.decode_head(message),
        child_frame_id=message["child_frame_id"],
        translation=ros.decode_vector(message["transform"]["translation"]),
        rotation=ros.decode_quaternion(message["transform"]["rotation"]),
    )
