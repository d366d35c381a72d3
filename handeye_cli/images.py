"""Image files into grey images of eight bits, and back."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handeye_cli import image_headers
from handeye_cli.errors import InputError
from handeye_cli.records import GreyImage

MAX_PIXELS = 200_000_000
"""Largest image that is decoded."""
MAX_SIDE = 32_766
"""Longest side of an image that is decoded; OpenCV samples none that is longer."""
MAX_BYTES = 2_000_000_000
"""Largest image file that is read."""


@dataclass(frozen=True)
class ImageFile:
    """A picture in a file of its own; an `ImageSource`.

    Attributes:
        path: Where it is.
        label: What people call it: the path as the document gives it.
    """

    path: Path
    label: str

    def load(self) -> GreyImage:
        """Return the (height, width) grey image.

        Raises:
            InputError: The file is missing, no regular file, empty, too large, or no image.
        """
        try:
            status = self.path.stat()
            if not stat.S_ISREG(status.st_mode):
                kind = "folder" if stat.S_ISDIR(status.st_mode) else "device or pipe"
                raise InputError(f"expected an image file, found a {kind}", where=self.label)
            if status.st_size > MAX_BYTES:
                found = f"{status.st_size / 1e9:.1f} GB"
                message = f"expected an image of at most {MAX_BYTES / 1e9:.0f} GB, found {found}"
                raise InputError(message, where=self.label)
            data = self.path.read_bytes()
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            message = f"expected an image file: {reason}"
            raise InputError(message, where=self.label) from error
        return decode_grey(data, self.label)


def decode_grey(data: bytes, label: str) -> GreyImage:
    """Return the grey image of an encoded one (PNG, JPEG, TIFF, PGM, ...).

    Colour becomes luminance, transparency is dropped, and a rotation in the EXIF data is not
    applied: the camera's intrinsics hold for the sensor's own rows and columns. Sixteen bits
    are scaled as `eight_bits` does.

    Args:
        data: The encoded image.
        label: Name of the image for error messages.

    Returns:
        (height, width) grey levels.

    Raises:
        InputError: It is no image or several, is damaged, or is too large.
    """
    import cv2

    if not data:
        raise InputError("expected an image, found no data", where=label)
    size = image_headers.stated_size(data)
    if size:
        _require_size(*size, label)
    data = image_headers.require_sound(data, label)
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error as error:
        message = f"expected an image, found one that cannot be decoded: {error.err}"
        raise InputError(message, where=label) from error
    if image is None:
        message = f"expected an image, found {len(data)} bytes that cannot be decoded as one"
        raise InputError(message, where=label)
    _require_size(image.shape[1], image.shape[0], label)
    if image.dtype == np.uint8:
        return image.view(np.uint8)
    if image.dtype != np.uint16:
        message = f"expected an image of 8 or 16 bits, found one of {image.dtype}"
        raise InputError(message, where=label)
    return eight_bits(image.view(np.uint16))


def encode_png(grey: GreyImage) -> bytes:
    """Return a (height, width) grey image as a PNG file, which keeps every grey level.

    Raises:
        InputError: The image has no pixels, or more than a PNG file can have.
    """
    import cv2

    try:
        _, data = cv2.imencode(".png", grey)
    except cv2.error as error:
        found = " x ".join(map(str, reversed(grey.shape)))
        raise InputError(f"expected an image that fits into a PNG file, found {found}") from error
    return bytes(data)


def eight_bits(deep: NDArray[np.uint16]) -> GreyImage:
    """Return sixteen-bit grey levels in eight bits.

    Sixteen bits often hold the ten or twelve of a sensor. The scale is the least full range of
    8 to 16 bits that holds the brightest pixel, so that 4095 of a 12-bit image becomes 255.

    Args:
        deep: (...) grey levels, at least one.

    Returns:
        (...) grey levels from 0 to 255.
    """
    bits = max(8, int(deep.max()).bit_length())
    # a table of all grey levels: exact, and without a copy of the image in floating point
    levels = np.arange(2**bits, dtype=np.float64) * (255.0 / (2**bits - 1))
    return np.asarray(np.rint(levels).astype(np.uint8)[deep])


def _require_size(width: int, height: int, label: str) -> None:
    if width * height > MAX_PIXELS:
        raise InputError(
            f"expected an image of at most {MAX_PIXELS // 1_000_000} megapixels, "
            f"found {width} x {height}",
            where=label,
        )
    if max(width, height) > MAX_SIDE:
        message = f"expected sides of at most {MAX_SIDE} pixels, found {width} x {height}"
        raise InputError(message, where=label)
