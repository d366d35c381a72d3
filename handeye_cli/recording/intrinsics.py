"""From a recorded CameraInfo to the camera of its images."""

from __future__ import annotations

from handeye_cli.errors import InputError
from handeye_cli.recording.messages import CameraInfoMessage
from handeye_cli.recording.selection import camera_parts
from handeye_cli.records import Camera

_COEFFICIENTS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8,), "equidistant": (4,)}
"""Numbers of distortion coefficients each model may have."""
_RECTIFIED = "image_rect"


def camera_of(info: CameraInfoMessage, image_topic: str) -> Camera | None:
    """Return the camera of the images of a topic, or None when it is not calibrated.

    K and P hold for the full image; a region moves the principal point, and binning averages
    `b` pixels whose common centre lies at `(b - 1) / 2`, so `u' = (u + 0.5) / b - 0.5`. Images of a
    topic `image_rect*` are rectified already: P holds for them, and no distortion.

    Args:
        info: The intrinsics.
        image_topic: Topic of the images.

    Raises:
        InputError: The distortion model is not known or has a wrong number of coefficients.
    """
    rectified = camera_parts(image_topic)[-1].startswith(_RECTIFIED)
    matrix = info.p if rectified else info.k
    stride = 4 if rectified else 3
    if matrix[0] == 0.0:
        return None
    model, distortion = ("plumb_bob", ()) if rectified else _distortion(info)
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


def _distortion(info: CameraInfoMessage) -> tuple[str, tuple[float, ...]]:
    model = info.distortion_model or ("plumb_bob" if not any(info.d) else "")
    if model not in _COEFFICIENTS:
        raise InputError(
            f"expected a distortion model out of {', '.join(_COEFFICIENTS)}, found {model!r}",
            where="CameraInfo",
            hint="choose another topic with --camera-info-topic, or rectified images",
        )
    if len(info.d) not in _COEFFICIENTS[model]:
        counts = " or ".join(map(str, _COEFFICIENTS[model]))
        raise InputError(
            f"expected {counts} coefficients of {model}, found {len(info.d)}", where="CameraInfo"
        )
    return model, tuple(info.d)
