"""A Python launch file for ROS 2 with one static transform."""

from __future__ import annotations

import json

from handeye_cli.documents.exports.static_transform_publisher import arguments
from handeye_cli.records.named_transform import NamedTransform

_TEMPLATE = '''"""Publish the pose of {child} in {parent}, as calibrated with handeye."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                arguments=[
{arguments}
                ],
            )
        ]
    )
'''
_INDENT = " " * 20


def text(transform: NamedTransform) -> str:
    """Return the launch file."""
    flat = [json.dumps(word) for word in arguments(transform)]
    pairs = zip(flat[::2], flat[1::2], strict=True)
    lines = [f"{_INDENT}{flag}, {value}," for flag, value in pairs]
    return _TEMPLATE.format(
        child=transform.child, parent=transform.parent, arguments="\n".join(lines)
    )
