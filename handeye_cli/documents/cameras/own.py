"""The camera of a document of our own: recording, features, stations or calibration."""

from __future__ import annotations

from functools import partial
from typing import Any

from handeye_cli.documents import parts, schema
from handeye_cli.documents.cameras.intrinsics import Cameras, Intrinsics
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError


def cameras(data: dict[str, Any], place: Place) -> Cameras | None:
    """Return the only camera of a document, or None for data of another form."""
    return {"camera": partial(_camera, data, place)} if "schema" in data else None


def _camera(data: dict[str, Any], place: Place) -> Intrinsics:
    kind = schema.kind_of(data, place.file)
    schema.validate(data, kind, place.file)
    camera = parts.camera_from_data(data.get("camera"), place)
    if camera is None:
        raise InputError(
            f"expected a document with a camera, found a {kind} document without one",
            where=place.file,
            hint="give a recording, features, stations or calibration with intrinsics",
        )
    return Intrinsics(
        (camera.fx, camera.fy),
        (camera.cx, camera.cy),
        camera.distortion,
        camera.model,
        (camera.width, camera.height),
        camera.covariance,
    )
