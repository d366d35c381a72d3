"""The 4x4 matrix of Zivid's SDK, which keeps all lengths in millimetres."""

from __future__ import annotations

from handeye_cli.conventions import MM
from handeye_cli.documents import layout
from handeye_cli.documents.exports.numbers import rows_of
from handeye_cli.geometry import se3
from handeye_cli.records.named_transform import NamedTransform


def text(transform: NamedTransform) -> str:
    """Return the file that `Matrix4x4` loads: the camera's pose in the gripper, or in the base."""
    matrix = se3.from_parts(transform.matrix[:3, :3], transform.matrix[:3, 3] / MM)
    data = {
        "__version__": {"serializer": 1, "data": 1},
        "FloatMatrix": {"Data": rows_of(matrix)},
    }
    return layout.dump(data, "yaml")
