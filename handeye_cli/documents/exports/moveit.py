"""The launch file for ROS 1 that MoveIt Calibration saves, with a quaternion x y z w."""

from __future__ import annotations

from handeye_cli.documents.exports.numbers import quaternion_of, translation_of, words
from handeye_cli.records.named_transform import NamedTransform

_TEMPLATE = """<launch>
  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_link_broadcaster"
        args="{arguments}"/>
</launch>
"""


def text(transform: NamedTransform) -> str:
    """Return the launch file."""
    numbers = words([*translation_of(transform.matrix), *quaternion_of(transform.matrix)])
    arguments = [*numbers, transform.parent, transform.child]
    return _TEMPLATE.format(arguments=" ".join(arguments))
