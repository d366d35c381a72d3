"""`nav_msgs/Odometry`; covariances and velocities are not used."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import PoseStamped

_TWIST = ros.VECTOR | {
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
}
DEFINITION = ros.definition(
    "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
    ros.HEADER | ros.POSE_WITH_COVARIANCE | _TWIST,
)
"""Its fields, the same in every release of ROS 2."""


def decode(message: Values) -> PoseStamped:
    """Return a decoded message as ours."""
    pose = ros.decode_pose(message["pose"]["pose"])
    return PoseStamped(ros.decode_head(message), **pose, child_frame_id=message["child_frame_id"])
