"""`tf2_msgs/TFMessage`."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.messages import TransformsMessage, TransformStamped

_PARTS = {
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
}
DEFINITION = ros.definition(
    "geometry_msgs/TransformStamped[] transforms\n", ros.HEADER | ros.QUATERNION | _PARTS
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Any) -> TransformsMessage:
    """Return a decoded ROS message as ours."""
    return TransformsMessage(tuple(_transform(each) for each in message.transforms))


def _transform(stamped: Any) -> TransformStamped:
    t, q = stamped.transform.translation, stamped.transform.rotation
    return TransformStamped(
        header=ros.decode_header(stamped.header),
        child_frame_id=stamped.child_frame_id,
        translation=(t.x, t.y, t.z),
        rotation=(q.x, q.y, q.z, q.w),
    )
