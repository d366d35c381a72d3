"""What several ROS messages share: their header, and the form of a definition with its parts."""

from __future__ import annotations

from typing import Any

from handeye_cli.recording.messages import Header

_RULE = "=" * 80
HEADER = {"std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n"}
"""Definition of the header; that of the time in it is known to every decoder."""
QUATERNION = {"geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"}
"""Definition of a quaternion."""


def definition(fields: str, parts: dict[str, str]) -> str:
    """Return the definition of a message followed by those of its parts, as `ros2msg` has it.

    Args:
        fields: The message's own lines, a type and a name each.
        parts: Lines of the messages it is made of, by their full names.
    """
    return fields + "".join(f"{_RULE}\nMSG: {name}\n{text}" for name, text in parts.items())


def decode_header(header: Any) -> Header:
    """Return a `std_msgs/Header` as ours."""
    stamp = header.stamp
    return Header(stamp.sec * 1_000_000_000 + stamp.nanosec, header.frame_id)
