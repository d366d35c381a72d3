"""What lenses, motion, sensors and files do to a picture, one fault at a time.

Faults of the light take and return (height, width) grey levels before noise and rounding; faults of
the picture take and return grey images. A chain of them, with `render.expose` between the two, is a
camera with those faults.
"""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.records import FloatArray, GreyImage

_WHITE = 255.0
_DISC_POINTS = 8192
_POINTS_PER_PIXEL = 64
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def defocused(light: FloatArray, radius_px: float) -> FloatArray:
    """Return light in which every point is an even disc, as out of focus.

    Args:
        light: (height, width) grey levels.
        radius_px: Of the disc, pixels.

    Raises:
        UsageError: The radius is negative.
    """
    return _convolved(light, disc_kernel(radius_px))


def moved(light: FloatArray, length_px: float, direction: float) -> FloatArray:
    """Return light in which every point is an even line, as of a camera in motion.

    Args:
        light: (height, width) grey levels.
        length_px: Of the line, which has its middle at the point, pixels.
        direction: Of the line, radians from x towards y.

    Raises:
        UsageError: The length is negative.
    """
    return _convolved(light, line_kernel(length_px, direction))


def curved(light: FloatArray, exponent: float) -> FloatArray:
    """Return light after a gamma curve that keeps black and white: below 1 it brightens.

    Args:
        light: (height, width) grey levels; below 0 is black, above 255 white.
        exponent: Of the curve.

    Raises:
        UsageError: The exponent is not above 0.
    """
    if not exponent > 0.0:
        raise UsageError(f"expected an exponent above 0, found {exponent:g}")
    return np.asarray(_WHITE * (np.clip(light, 0.0, _WHITE) / _WHITE) ** exponent)


def saturated(light: FloatArray, gain: float) -> FloatArray:
    """Return light so many times brighter, clipped at white.

    Args:
        light: (height, width) grey levels.
        gain: Factor.

    Raises:
        UsageError: The gain is not above 0.
    """
    if not gain > 0.0:
        raise UsageError(f"expected a gain above 0, found {gain:g}")
    return np.minimum(gain * light, _WHITE)


def compressed(picture: GreyImage, quality: int) -> GreyImage:
    """Return a picture after JPEG compression.

    Args:
        picture: (height, width) grey image.
        quality: JPEG's, 1 to 100.

    Raises:
        UsageError: The quality is none of JPEG's.
    """
    if not 1 <= quality <= 100:
        raise UsageError(f"expected a JPEG quality of 1 to 100, found {quality}")
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def salted(picture: GreyImage, count: int, rng: np.random.Generator) -> GreyImage:
    """Return a picture with broken pixels, each black or white.

    Args:
        picture: (height, width) grey image.
        count: Number of broken pixels.
        rng: Source of their places and colours.

    Raises:
        UsageError: There are not as many pixels.
    """
    if not 0 <= count <= picture.size:
        raise UsageError(f"expected 0 to {picture.size} broken pixels, found {count}")
    broken = picture.copy()
    places = rng.choice(picture.size, count, replace=False)
    broken.flat[places] = rng.choice(np.array([0, 255], dtype=np.uint8), count)
    return broken


def disc_kernel(radius_px: float) -> FloatArray:
    """Return the (2 m + 1, 2 m + 1) kernel of an even disc, of sum 1.

    Raises:
        UsageError: The radius is negative.
    """
    if not radius_px >= 0.0:
        raise UsageError(f"expected a radius of 0 px or more, found {radius_px:g} px")
    # A sunflower's seeds: each has as much of the disc's area around it.
    seed = np.arange(_DISC_POINTS)
    angle, away = _GOLDEN_ANGLE * seed, radius_px * np.sqrt((seed + 0.5) / _DISC_POINTS)
    return _kernel(away[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def line_kernel(length_px: float, direction: float) -> FloatArray:
    """Return the (2 m + 1, 2 m + 1) kernel of an even line, of sum 1.

    Raises:
        UsageError: The length is negative.
    """
    if not length_px >= 0.0:
        raise UsageError(f"expected a length of 0 px or more, found {length_px:g} px")
    count = int(np.ceil(_POINTS_PER_PIXEL * (length_px + 1.0)))
    along = length_px * ((np.arange(count) + 0.5) / count - 0.5)
    return _kernel(along[:, None] * np.array([np.cos(direction), np.sin(direction)]))


def _kernel(points: FloatArray) -> FloatArray:
    """Return the kernel of (n, 2) points (x, y), each shared by nearness among four pixels.

    The sharing keeps the mean of the points and adds up to 1/4 squared pixels to their variance.
    """
    margin = int(np.ceil(np.abs(points).max()))
    pixel = np.arange(-margin, margin + 1)
    x, y = np.maximum(0.0, 1.0 - np.abs(points.T[..., None] - pixel))
    # Points on either side of the middle make the kernel as symmetric as what it stands for.
    half = y.T @ x / len(points)
    return np.asarray((half + half[::-1, ::-1]) / 2.0)


def _convolved(light: FloatArray, kernel: FloatArray) -> FloatArray:
    # The kernels look the same after a half turn, so that OpenCV's correlation is a convolution.
    return np.asarray(cv2.filter2D(light, cv2.CV_64F, kernel, borderType=cv2.BORDER_REPLICATE))
