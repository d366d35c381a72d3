"""A `geometry_msgs/msg/PoseArray` written as a ROS 2 recording of one message."""

from __future__ import annotations

import io
import struct

import numpy as np
from mcap.writer import CompressionType, Writer

from handeye_cli import __version__
from handeye_cli.recording.decoders import ros
from handeye_cli.records import FloatArray

SCHEMA = "geometry_msgs/msg/PoseArray"
TOPIC = "/handeye/plan"
_PARTS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
}
DEFINITION = ros.definition(
    "std_msgs/Header header\ngeometry_msgs/Pose[] poses\n", ros.HEADER | ros.QUATERNION | _PARTS
)
"""Its fields, the same in every release of ROS 2."""
_ENCAPSULATION = b"\x00\x01\x00\x00"
"""Plain CDR in little-endian order."""


def mcap_bytes(poses: FloatArray, frame_id: str) -> bytes:
    """Return an MCAP file with one message, at the time 0; the same bytes for the same poses.

    Args:
        poses: (N, 7) positions in metres and quaternions x y z w.
        frame_id: Name of the frame they are in.
    """
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="ros2", library=f"handeye {__version__}")
    schema = writer.register_schema(SCHEMA, "ros2msg", DEFINITION.encode())
    channel = writer.register_channel(TOPIC, "cdr", schema, {"offered_qos_profiles": ""})
    writer.add_message(channel, log_time=0, publish_time=0, data=payload(poses, frame_id))
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def payload(poses: FloatArray, frame_id: str) -> bytes:
    """Return a PoseArray as CDR: time 0, the frame, the number of poses and their numbers.

    Args:
        poses: (N, 7) positions in metres and quaternions x y z w.
        frame_id: Name of the frame they are in.
    """
    name = frame_id.encode() + b"\x00"
    head = struct.pack("<iII", 0, 0, len(name)) + name
    head += bytes(-len(head) % 4) + struct.pack("<I", len(poses))
    # where there are no doubles, nothing has to start on their boundary
    head += bytes(-len(head) % 8) if len(poses) else b""
    return _ENCAPSULATION + head + np.ascontiguousarray(poses, dtype="<f8").tobytes()
