"""Kalibr's `camchain.yaml`: the cameras cam0, cam1, ... of a rig."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

from handeye_cli.documents.cameras.intrinsics import (
    Cameras,
    Intrinsics,
    exactly,
    focal_lengths,
    image_size,
    lens,
    numbers,
)
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError

_CAMERA = re.compile(r"cam[0-9]+")
_PINHOLE = "pinhole"
_LENSES = {"radtan": "plumb_bob", "equidistant": "equidistant", "equi": "equidistant"}
_NO_LENS = ("none", "")


def cameras(data: dict[str, Any], place: Place) -> Cameras | None:
    """Return the cameras of a camchain, or None for data of another form."""
    entries = {
        name: entry
        for name, entry in data.items()
        if _CAMERA.fullmatch(name) and isinstance(entry, dict) and "intrinsics" in entry
    }
    return {
        name: partial(_camera, entry, place.key(name)) for name, entry in entries.items()
    } or None


def _camera(entry: dict[str, Any], place: Place) -> Intrinsics:
    kind = entry.get("camera_model", _PINHOLE)
    if kind != _PINHOLE:
        raise InputError(
            f"expected the camera model {_PINHOLE}, found {kind!r}",
            where=str(place.key("camera_model")),
            hint="calibrate the camera as pinhole-radtan or pinhole-equi",
        )
    fx, fy, cx, cy = exactly(4, entry["intrinsics"], place.key("intrinsics"))
    model, distortion = _lens(entry, place)
    size = entry.get("resolution")
    return Intrinsics(
        focal_lengths((fx, fy), place.key("intrinsics")),
        (cx, cy),
        distortion,
        model,
        None if size is None else image_size(size, place.key("resolution")),
    )


def _lens(entry: dict[str, Any], place: Place) -> tuple[str, tuple[float, ...]]:
    name = entry.get("distortion_model") or ""
    coefficients = numbers(entry.get("distortion_coeffs", []), place.key("distortion_coeffs"))
    if name in _NO_LENS and not any(coefficients):
        return "plumb_bob", ()
    return lens(name, coefficients, _LENSES, place.key("distortion_model"))
