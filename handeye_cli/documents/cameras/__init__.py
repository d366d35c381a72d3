"""Intrinsics from the files of other tools, and from documents of our own.

What kind of file it is, it says itself: every row of `FORMATS` is asked for the cameras it finds
in the data, and the first that knows the form answers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from handeye_cli.documents import files, text
from handeye_cli.documents.cameras import file_storage
from handeye_cli.documents.cameras.intrinsics import Cameras, Intrinsics
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError, did_you_mean
from handeye_cli.records import Camera

_ROOM = "handeye_cli.documents.cameras"
FORMATS = {
    "a document of handeye": f"{_ROOM}.own",
    "a Kalibr camchain": f"{_ROOM}.kalibr",
    "a ROS or OpenCV calibration": f"{_ROOM}.matrices",
    "a mapping of fx, fy, cx and cy": f"{_ROOM}.plain",
}
"""Modules with `cameras(data, place)`, by what people call the form."""

ImageSize = tuple[int, int]
"""Width and height in pixels."""


@dataclass(frozen=True)
class CameraSource:
    """Intrinsics that were read, and what provenance says of them.

    Attributes:
        name: The path as it was given.
        sha256: Digest of its bytes in hex.
        camera: What it holds.
    """

    name: str
    sha256: str
    camera: Camera


def read(source: str, image_size: ImageSize | None) -> CameraSource:
    """Return the intrinsics of a file.

    Args:
        source: A path; of a file with several cameras `path#name`, such as `camchain.yaml#cam1`.
        image_size: Size of the images the intrinsics are for, or None where it is not known.

    Raises:
        InputError: The file cannot be read or has no such camera; its lens cannot be described by
            one of our models; or its images have another size.
    """
    path, wanted = _split(source)
    content = files.read_bytes(path)
    place = Place(files.label_of(path))
    given = _choose(_cameras(_plain_data(content, place.file), place), wanted, source)
    camera = given.camera(_size(given, image_size, place))
    return CameraSource(source, hashlib.sha256(content).hexdigest(), camera)


def sha256_of(source: str) -> str:
    """Return the SHA-256 of a file of intrinsics.

    Args:
        source: As `read` takes it.

    Raises:
        InputError: The file cannot be read.
    """
    path, _ = _split(source)
    return hashlib.sha256(files.read_bytes(path)).hexdigest()


def _split(source: str) -> tuple[str, str | None]:
    path, mark, name = source.rpartition("#")
    if not mark or not path or _is_there(source):
        return source, None
    return path, name


def _is_there(path: str) -> bool:
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def _plain_data(content: bytes, label: str) -> Any:
    if content.lstrip().startswith(b"<"):
        return file_storage.from_xml(content, label)
    return text.parse(file_storage.as_yaml(content), label)


def _cameras(data: Any, place: Place) -> Cameras:
    for module in FORMATS.values() if isinstance(data, dict) else ():
        found: Cameras | None = import_module(module).cameras(data, place)
        if found is not None:
            return found
    raise InputError(
        f"expected a file with intrinsics, found {describe(data)}",
        where=place.file,
        hint=f"it may be {'; '.join(FORMATS)}",
    )


def _choose(cameras: Cameras, wanted: str | None, source: str) -> Intrinsics:
    listed = ", ".join(cameras)
    if wanted is None and len(cameras) > 1:
        raise InputError(
            f"expected one camera, found {len(cameras)}: {listed}",
            where=source,
            hint=f"choose one, such as {source}#{next(iter(cameras))}",
        )
    if wanted is not None and wanted not in cameras:
        near = did_you_mean(wanted, list(cameras))
        raise InputError(
            f"expected one of the file's cameras, found {wanted!r}; it has: {listed}",
            where=source,
            hint=f"did you mean {near!r}?" if near else None,
        )
    read_it: Callable[[], Intrinsics] = cameras[wanted or next(iter(cameras))]
    return read_it()


def _size(given: Intrinsics, images: ImageSize | None, place: Place) -> ImageSize:
    if given.size is None and images is None:
        raise InputError(
            "expected the size of the camera's images, found none",
            where=place.file,
            hint="add image_width and image_height",
        )
    if given.size and images and given.size != images:
        raise InputError(
            f"expected intrinsics for images of {images[0]}x{images[1]} as the recording's, found "
            f"those for {given.size[0]}x{given.size[1]}",
            where=place.file,
            hint="intrinsics hold for one size and region: calibrate the camera as it was recorded",
        )
    return given.size or images or (0, 0)
