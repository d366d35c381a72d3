"""OpenCV's FileStorage in YAML: the pose as one matrix and in parts, and all that is known of it.

Its YAML is not quite YAML: the first line is no directive, and matrices carry a tag of their own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from handeye_cli.documents.exports.numbers import rows_of, words
from handeye_cli.records import Camera, FloatArray
from handeye_cli.records.named_transform import NamedTransform

_HEADER = "%YAML:1.0\n---\n"


def text(transform: NamedTransform) -> str:
    """Return the file: `parent`, `child`, `setup`, `parent_T_child`, `R`, `t` and what is known.

    What may be missing: `covariance`, and `camera_matrix`, `distortion_coefficients`,
    `distortion_model`, `image_width` and `image_height` of the camera.
    """
    nodes: dict[str, Any] = {
        "parent": transform.parent,
        "child": transform.child,
        "setup": str(transform.setup),
        "parent_T_child": transform.matrix,
        "R": transform.matrix[:3, :3],
        "t": transform.matrix[:3, 3:],
    }
    if transform.covariance is not None:
        nodes["covariance"] = transform.covariance
    if transform.camera is not None:
        nodes |= _camera(transform.camera)
    return _HEADER + _dump(nodes)


def _camera(camera: Camera) -> dict[str, Any]:
    K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    # an empty matrix is one that OpenCV takes for no matrix at all
    distortion = np.array([camera.distortion or (0.0,) * 4])
    return {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_matrix": K,
        "distortion_model": camera.model,
        "distortion_coefficients": distortion,
    }


def _dump(nodes: Mapping[str, Any]) -> str:
    return "".join(
        f"{key}: {_matrix(value) if isinstance(value, np.ndarray) else json.dumps(value)}\n"
        for key, value in nodes.items()
    )


def _matrix(matrix: FloatArray) -> str:
    rows, columns = matrix.shape
    data = ",\n       ".join(", ".join(words(row)) for row in rows_of(matrix))
    return f"!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]"
