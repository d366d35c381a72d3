"""A fixed joint of a URDF, whose angles are roll, pitch and yaw about fixed axes."""

from __future__ import annotations

from handeye_cli.documents.exports.numbers import roll_pitch_yaw_of, translation_of, words
from handeye_cli.records.named_transform import NamedTransform

_TEMPLATE = """<joint name="{name}" type="fixed">
  <parent link="{parent}"/>
  <child link="{child}"/>
  <origin xyz="{xyz}" rpy="{rpy}"/>
</joint>
"""


def text(transform: NamedTransform) -> str:
    """Return the joint, to be put into a robot description that has both links."""
    return _TEMPLATE.format(
        name=f"{transform.parent}_to_{transform.child}",
        parent=transform.parent,
        child=transform.child,
        xyz=" ".join(words(translation_of(transform.matrix))),
        rpy=" ".join(words(roll_pitch_yaw_of(transform.matrix))),
    )
