"""`tf2_msgs/TFMessage`, and `tf/tfMessage`, which it was before."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.decoders.transform_stamped import decode_transform
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import TransformsMessage

DEFINITION = ros.definition("geometry_msgs/TransformStamped[] transforms\n", ros.TRANSFORM_STAMPED)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> TransformsMessage:
    """Return a decoded message as ours."""
    return TransformsMessage(tuple(decode_transform(each) for each in message["transforms"]))
