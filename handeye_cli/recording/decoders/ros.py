"""What several ROS messages share: their header, and the form of a definition with its parts."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.layout import RULE, Values
from handeye_cli.recording.messages import Header

HEADER = {"std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n"}
"""Definition of the header; that of the time in it is known to every decoder."""
VECTOR = {"geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n"}
"""Definition of a vector."""
QUATERNION = {"geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"}
"""Definition of a quaternion."""
POSE = QUATERNION | {
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
}
"""Definitions of a pose and its parts."""
POSE_WITH_COVARIANCE = POSE | {
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance\n"
}
"""Definitions of a pose with its covariance and their parts."""
TRANSFORM_STAMPED = (
    HEADER
    | VECTOR
    | QUATERNION
    | {
        "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\n"
        "geometry_msgs/Transform transform\n",
        "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\n"
        "geometry_msgs/Quaternion rotation\n",
    }
)
"""Definitions of a transform with its header and their parts."""
HEAD_FIELDS = 1
"""Fields at the start of a message that say when and in which frame."""


def definition(fields: str, parts: dict[str, str]) -> str:
    """Return the definition of a message followed by those of its parts, as `ros2msg` has it.

    Args:
        fields: The message's own lines, a type and a name each.
        parts: Lines of the messages it is made of, by their full names.
    """
    return fields + "".join(f"{RULE}\nMSG: {name}\n{text}" for name, text in parts.items())


def decode_head(message: Values) -> Header:
    """Return the `std_msgs/Header` of a message as ours."""
    header = message["header"]
    return Header(header["stamp"], header["frame_id"])


def decode_vector(vector: Values) -> tuple[float, float, float]:
    """Return a point or a vector as its numbers."""
    return vector["x"], vector["y"], vector["z"]


def decode_quaternion(quaternion: Values) -> tuple[float, float, float, float]:
    """Return a quaternion as x y z w."""
    return quaternion["x"], quaternion["y"], quaternion["z"], quaternion["w"]


def decode_pose(pose: Values) -> dict[str, Any]:
    """Return a `geometry_msgs/Pose` as the arguments of our messages."""
    return {
        "translation": decode_vector(pose["position"]),
        "rotation": decode_quaternion(pose["orientation"]),
    }
