"""`geometry_msgs/PoseStamped`."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.messages import PoseStamped

_PARTS = {
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
}
DEFINITION = ros.definition(
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n", ros.HEADER | ros.QUATERNION | _PARTS
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Any) -> PoseStamped:
    """Return a decoded ROS message as ours."""
    t, q = message.pose.position, message.pose.orientation
    return PoseStamped(
        header=ros.decode_header(message.header),
        translation=(t.x, t.y, t.z),
        rotation=(q.x, q.y, q.z, q.w),
    )
