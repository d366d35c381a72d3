"""A camera matrix and its coefficients, as ROS and OpenCV, and scripts that use it, write them.

ROS: `camera_matrix`, `distortion_coefficients`, `distortion_model`, `image_width`, `image_height`.
OpenCV's FileStorage leaves the names to the program, so the usual ones are known. A number at the
end of a name belongs to a camera: M1 and D1, M2 and D2.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import partial
from typing import Any

from handeye_cli.documents.cameras.intrinsics import (
    Cameras,
    Intrinsics,
    elements,
    exactly,
    focal_lengths,
    image_size,
    lens,
    numbers,
)
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError

_MATRIX = ("cameramatrix", "intrinsicmatrix", "cameraintrinsics", "mtx", "k", "m")
_COEFFICIENTS = (
    "distortioncoefficients", "distortioncoeffs", "distcoefficients", "distcoeffs", "distcoeff",
    "distortion", "dist", "d",
)  # fmt: skip
_WIDTH, _HEIGHT = ("imagewidth", "width", "imgwidth"), ("imageheight", "height", "imgheight")
_SIZE = ("imagesize", "size", "imgsize", "resolution", "imageresolution")
_MODEL = ("distortionmodel", "model")
_FISHEYE = ("fisheyemodel", "fisheye", "isfisheye")
_MODELS = {
    "plumb_bob": "plumb_bob",
    "rational_polynomial": "rational_polynomial",
    "equidistant": "equidistant",
    "fisheye": "equidistant",
    "kannala_brandt": "equidistant",
}
_NUMBERED = re.compile(r"(.*?)([0-9]*)")
_SKEW = 1e-9
"""Largest skew, relative to the focal length, that is none."""


def cameras(data: dict[str, Any], place: Place) -> Cameras | None:
    """Return the cameras of matrices with known names, or None for data of another form."""
    found = [(*_parts(key), key) for key in data]
    return {
        key: partial(_camera, data, key, number, place)
        for stem, number, key in found
        if stem in _MATRIX
    } or None


def _parts(key: str) -> tuple[str, str]:
    """Return a key's name without case and separators, and the number at its end."""
    match = _NUMBERED.fullmatch(re.sub(r"[^a-z0-9]", "", key.lower()))
    return (match[1], match[2]) if match else (key, "")


def _camera(data: dict[str, Any], key: str, camera: str, place: Place) -> Intrinsics:
    fx, fy, cx, cy = _pinhole(data[key], place.key(key))
    model, distortion = _lens(data, camera, place)
    return Intrinsics(
        focal_lengths((fx, fy), place.key(key)), (cx, cy), distortion, model, _size(data, place)
    )


def _pinhole(value: Any, place: Place) -> tuple[float, float, float, float]:
    fx, skew, cx, y, fy, cy, *last = exactly(9, elements(value), place)
    if abs(skew) > _SKEW * abs(fx) or y != 0.0 or last != [0.0, 0.0, 1.0]:
        raise InputError(
            "expected a camera matrix [fx, 0, cx, 0, fy, cy, 0, 0, 1], found "
            f"[{', '.join(f'{each:g}' for each in (fx, skew, cx, y, fy, cy, *last))}]",
            where=str(place),
        )
    return fx, fy, cx, cy


def _lens(data: dict[str, Any], camera: str, place: Place) -> tuple[str, tuple[float, ...]]:
    key = _key(data, _COEFFICIENTS, camera)
    if key is None:
        raise InputError(
            "expected distortion coefficients beside the camera matrix, found the keys "
            f"{', '.join(data)}",
            where=str(place),
            hint="name them distortion_coefficients; an empty list means none",
        )
    coefficients = numbers(elements(data[key]), place.key(key))
    return lens(_model(data, len(coefficients), place), coefficients, _MODELS, place.key(key))


def _model(data: dict[str, Any], count: int, place: Place) -> str:
    """Return the model's name; where there is none the number of coefficients tells it."""
    key = _key(data, _MODEL)
    named = data[key] if key else None
    if named is not None and not isinstance(named, str):
        raise InputError(
            f"expected the name of a distortion model, found {describe(named)}",
            where=str(place.key(key or "")),
        )
    fisheye = _key(data, _FISHEYE)
    if fisheye and data[fisheye]:
        return "fisheye"
    # some writers keep the name of the first five coefficients for more of them
    if named and (named != "plumb_bob" or count <= 5):
        return named.lower()
    return "plumb_bob" if count <= 5 else "rational_polynomial"


def _size(data: dict[str, Any], place: Place) -> tuple[int, int] | None:
    width, height = _key(data, _WIDTH), _key(data, _HEIGHT)
    if width and height:
        return image_size([data[width], data[height]], place.key(width))
    key = _key(data, _SIZE)
    if key is None:
        return None
    value = data[key]
    if isinstance(value, dict) and {"width", "height"} <= value.keys():
        return image_size([value["width"], value["height"]], place.key(key))
    return image_size(elements(value), place.key(key))


def _key(data: Iterable[str], stems: Iterable[str], camera: str = "") -> str | None:
    """Return the key with one of these names, that of a camera before one of all cameras."""
    known = {_parts(key): key for key in data if _parts(key)[0] in stems}
    wanted = [(stem, number) for number in (camera, "") for stem in stems]
    return next((known[each] for each in wanted if each in known), None)
