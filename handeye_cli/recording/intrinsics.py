"""From a recorded CameraInfo to the camera of its images."""

from __future__ import annotations

import numpy as np

from handeye_cli.errors import InputError
from handeye_cli.recording.layout import LARGEST
from handeye_cli.recording.messages import CameraInfoMessage
from handeye_cli.recording.selection import camera_parts
from handeye_cli.records import Camera

_COEFFICIENTS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8, 12), "equidistant": (4,)}
"""Numbers of distortion coefficients each model may have."""
_ALIASES = {"kannala_brandt": "equidistant"}
"""Foxglove's names of models that have another in ROS."""
_RECTIFIED = "image_rect"


def camera_of(info: CameraInfoMessage, image_topic: str, where: str) -> Camera | None:
    """Return the camera of the images of a topic, or None when it is not calibrated.

    K and P hold for the full image; a region moves the principal point, and binning averages
    `b` pixels whose common centre lies at `(b - 1) / 2`, so `u' = (u + 0.5) / b - 0.5`. Images of a
    topic `image_rect*` are rectified already: P holds for them, and no distortion.

    Args:
        info: The intrinsics.
        image_topic: Topic of the images.
        where: File and topic of the intrinsics, for people.

    Raises:
        InputError: The distortion model is not known or has a wrong number of coefficients; or
            the numbers are those of no camera.
    """
    rectified = is_rectified(image_topic)
    matrix = info.p if rectified else info.k
    stride = 4 if rectified else 3
    if matrix[0] == 0.0:
        return None
    model, distortion = ("plumb_bob", ()) if rectified else _distortion(info, where)
    _require_plausible(where, info, (matrix[0], matrix[stride + 1], matrix[2], matrix[stride + 2]))
    x, y, width, height = info.roi
    bin_x, bin_y = max(info.binning_x, 1), max(info.binning_y, 1)
    return Camera(
        width=(width or info.width) // bin_x,
        height=(height or info.height) // bin_y,
        fx=matrix[0] / bin_x,
        fy=matrix[stride + 1] / bin_y,
        cx=(matrix[2] - x + 0.5) / bin_x - 0.5,
        cy=(matrix[stride + 2] - y + 0.5) / bin_y - 0.5,
        distortion=distortion,
        model=model,
    )


def is_rectified(image_topic: str) -> bool:
    """Return whether the images of a topic are rectified, by its name."""
    return camera_parts(image_topic)[-1].startswith(_RECTIFIED)


def _require_plausible(where: str, info: CameraInfoMessage, numbers: tuple[float, ...]) -> None:
    if not ((np.abs([*numbers, *info.d]) <= LARGEST).all() and min(numbers[:2]) > 0.0):
        found = ", ".join(f"{number:g}" for number in (*numbers, *info.d))
        raise InputError(
            "expected finite intrinsics with positive focal lengths,"
            f" found fx, fy, cx, cy and distortion {found}",
            where=where,
            hint="calibrate the camera before recording, or give intrinsics of your own",
        )
    if not (info.width and info.height):
        raise InputError(
            f"expected the size of the camera's image, found {info.width} x {info.height}",
            where=where,
            hint="calibrate the camera before recording, or give intrinsics of your own",
        )


def _distortion(info: CameraInfoMessage, where: str) -> tuple[str, tuple[float, ...]]:
    name = info.distortion_model or ("plumb_bob" if not any(info.d) else "")
    model = _ALIASES.get(name, name)
    if model not in _COEFFICIENTS:
        known = ", ".join((*_COEFFICIENTS, *_ALIASES))
        raise InputError(
            f"expected a distortion model out of {known}, found {model!r}",
            where=where,
            hint="choose another topic with --camera-info-topic, or rectified images",
        )
    if len(info.d) not in _COEFFICIENTS[model]:
        counts = " or ".join(map(str, _COEFFICIENTS[model]))
        raise InputError(
            f"expected {counts} coefficients of {model}, found {len(info.d)}",
            where=where,
            hint="choose another topic with --camera-info-topic, or rectified images",
        )
    return model, tuple(info.d)
