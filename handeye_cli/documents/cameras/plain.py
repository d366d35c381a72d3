"""A mapping of fx, fy, cx and cy, as our own documents have it below `camera`."""

from __future__ import annotations

from functools import partial
from typing import Any

from handeye_cli.documents.cameras.intrinsics import (
    Cameras,
    Intrinsics,
    focal_lengths,
    image_size,
    lens,
    number,
    numbers,
)
from handeye_cli.documents.place import Place

_KEYS = ("fx", "fy", "cx", "cy")
_MODELS = {name: name for name in ("plumb_bob", "rational_polynomial", "equidistant")}


def cameras(data: dict[str, Any], place: Place) -> Cameras | None:
    """Return the only camera of a mapping, or None for data of another form."""
    inner = data.get("camera")
    if isinstance(inner, dict):
        data, place = inner, place.key("camera")
    if not all(key in data for key in _KEYS):
        return None
    return {"camera": partial(_camera, data, place)}


def _camera(data: dict[str, Any], place: Place) -> Intrinsics:
    fx, fy, cx, cy = (number(data[key], place.key(key)) for key in _KEYS)
    coefficients = numbers(data.get("distortion", []), place.key("distortion"))
    name = data.get("model") or ("plumb_bob" if len(coefficients) < 8 else "rational_polynomial")
    model, distortion = lens(name, coefficients, _MODELS, place.key("distortion"))
    size = [data.get("width"), data.get("height")]
    return Intrinsics(
        focal_lengths((fx, fy), place),
        (cx, cy),
        distortion,
        model,
        None if None in size else image_size(size, place.key("width")),
    )
