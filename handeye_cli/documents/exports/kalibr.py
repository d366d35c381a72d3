"""A camchain in Kalibr's form, in which the frame that the camera is fixed to stands for the IMU.

Kalibr names a transform after the way its points go: `T_cam_imu` takes points of the IMU to the
camera, so it is the inverse of the pose that we call the answer.
"""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import layout
from handeye_cli.documents.exports.numbers import rows_of
from handeye_cli.geometry import se3
from handeye_cli.records import Camera
from handeye_cli.records.named_transform import NamedTransform

_COEFFICIENTS = 4
"""Of each of Kalibr's lenses that we have."""
_LENSES = {"plumb_bob": "radtan", "equidistant": "equidistant"}


def text(transform: NamedTransform) -> str:
    """Return the camchain of one camera, `cam0`.

    The intrinsics are left out where they are unknown, or are of a lens that Kalibr has not; a
    comment then says so.
    """
    entry: dict[str, Any] = {"T_cam_imu": rows_of(se3.inverse(transform.matrix))}
    notes = [f"T_cam_imu takes points of {transform.parent} to {transform.child}, in metres"]
    if transform.camera is not None:
        lens = _lens(transform.camera)
        entry |= lens
        notes += [] if lens else [_without_lens(transform.camera)]
    return "".join(f"# {note}\n" for note in notes) + layout.dump({"cam0": entry}, "yaml")


def _lens(camera: Camera) -> dict[str, Any]:
    """Return the intrinsics of a camera, or nothing where Kalibr has no such lens."""
    coefficients, beyond = (
        camera.distortion[:_COEFFICIENTS],
        camera.distortion[_COEFFICIENTS:],
    )
    if camera.model not in _LENSES or any(beyond):
        return {}
    padding = [0.0] * (_COEFFICIENTS - len(coefficients))
    return {
        "camera_model": "pinhole",
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "distortion_model": _LENSES[camera.model],
        "distortion_coeffs": [*coefficients, *padding],
        "resolution": [camera.width, camera.height],
    }


def _without_lens(camera: Camera) -> str:
    found = ", ".join(f"{each:g}" for each in camera.distortion)
    return f"intrinsics left out: Kalibr has no lens {camera.model} of {found}"
