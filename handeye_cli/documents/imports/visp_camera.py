"""ViSP's `camera.xml`: the intrinsics that its camera parser reads and writes.

A camera has one or more models. `px`, `py`, `u0` and `v0` are in pixels, with (0, 0) at the centre
of the top-left one; `kud` of perspectiveProjWithDistortion is the first radial coefficient of
OpenCV's model, and `kdu` its approximate inverse, which is not needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.documents import text
from handeye_cli.documents.cameras.intrinsics import focal_lengths, image_size, number
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Camera

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_PLAIN, _DISTORTED = "perspectiveProjWithoutDistortion", "perspectiveProjWithDistortion"


def read(content: bytes, place: Place) -> Camera:
    """Return the only camera of a file, with distortion where it has such a model.

    Args:
        content: The XML text.
        place: The file.

    Raises:
        InputError: It is no file of ViSP's, has several cameras, or a model that is not ours.
    """
    from handeye_cli import markup

    root = markup.parse(content, place.file)
    cameras = root.findall("camera")
    if root.tag != "root" or len(cameras) != 1:
        names = ", ".join(_text(each, "name", place) for each in cameras)
        raise InputError(
            f"expected XML of ViSP with one camera, found <{root.tag}> with {len(cameras)}"
            f"{names and f': {names}'}",
            where=str(place),
            hint="give the intrinsics of one of them with --camera FILE",
        )
    return _camera(cameras[0], place.key("camera"))


def _camera(camera: Element, place: Place) -> Camera:
    models = {_text(model, "type", place.key("model")): model for model in camera.findall("model")}
    wanted = next((name for name in (_DISTORTED, _PLAIN) if name in models), None)
    if wanted is None:
        raise InputError(
            f"expected the model {_DISTORTED} or {_PLAIN}, found {', '.join(models) or 'none'}",
            where=str(place.key("model")),
            hint="give intrinsics of another calibration with --camera FILE, or leave them to "
            "solve --calibrate-intrinsics with --no-camera",
        )
    model, at = models[wanted], place.key("model")
    fx, fy, cx, cy = (_number(model, key, at) for key in ("px", "py", "u0", "v0"))
    focal_lengths((fx, fy), at)
    sides = [_number(camera, key, place) for key in ("image_width", "image_height")]
    width, height = image_size(sides, place.key("image_width"))
    k1 = _number(model, "kud", at) if wanted == _DISTORTED else 0.0
    distortion = (k1, 0.0, 0.0, 0.0, 0.0) if k1 else ()
    return Camera(width, height, fx, fy, cx, cy, distortion)


def _text(element: Element, key: str, place: Place) -> str:
    found = element.findtext(key)
    if found is None:
        inside = describe({each.tag: None for each in element})
        raise InputError(f"expected <{key}>, found {inside}", where=str(place))
    return found.strip()


def _number(element: Element, key: str, place: Place) -> float:
    return number(text.resolve(_text(element, key, place)), place.key(key))
