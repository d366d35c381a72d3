"""A picture of what was found in an image, to judge it by eye.

Above the image stands what was found, or why nothing was; in it, every point at its place between
the pixels, the outline of all of them, the axes of the target, and the outlines of its discs.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray, Observation, Station
from handeye_cli.render.text import pixels as sigma_text
from handeye_cli.render.text import printable
from handeye_cli.targets.plate_map import plate_map

ColourImage = NDArray[np.uint8]
"""(height, width, 3) levels of blue, green and red, as OpenCV writes them."""

_SMALL = 800
"""Images whose longer side has fewer pixels are shown at twice their size."""
_UNIT = 1600
"""Pixels of the longer side for each pixel that a line is wide."""
_NARROWEST = 480
"""Pixels across that a picture has at least, for the words above it."""
_SUBPIXEL_BITS = 4
_ARM = 4.5
"""Half the length of a cross, in line widths."""
_AXIS = 0.4
"""Length of an axis over the extent of the points."""
_RING = 48
_FONT, _FONT_SCALE, _LEADING, _MARGIN = cv2.FONT_HERSHEY_SIMPLEX, 0.55, 1.7, 8

_BAND, _WORDS = (40, 30, 30), (255, 255, 255)
_POINT, _HULL, _DISC = (255, 0, 255), (0, 190, 255), (220, 200, 0)
_RED, _GREEN = (60, 60, 255), (60, 220, 60)


def draw_detection(
    grey: GreyImage,
    station: Station,
    points: FloatArray,
    *,
    discs: FloatArray | None = None,
    camera: Camera | None = None,
) -> ColourImage:
    """Return the picture of what was found in an image.

    Args:
        grey: (height, width) image.
        station: What was found in it, or the reason why nothing was.
        points: (n, 3) points of the target, metres, which the observation's ids point into.
        discs: (m, 3) centre x, y and radius of the target's discs, metres, if it has any.
        camera: Intrinsics; without them the axes and discs are drawn without distortion.
    """
    factor = enlargement(grey)
    unit = max(1, round(factor * max(grey.shape) / _UNIT))
    width = max(_NARROWEST, factor * grey.shape[1])
    seen = station.observation
    band = _band(f"{printable(station.name)}: {_result(station, len(points))}", width, unit)
    canvas = _Canvas(_below(band, grey, factor), factor, unit, len(band))
    if seen is not None and len(seen.ids) > 0:
        to_pixel = _plate_to_pixel(points, seen, camera)
        if to_pixel is not None and discs is not None:
            canvas.lines(to_pixel(_rings(discs)), _DISC, closed=True)
        hull = cv2.convexHull(seen.pixels.astype(np.float32))
        canvas.lines(np.reshape(hull, (1, -1, 2)).astype(np.float64), _HULL, closed=True)
        if to_pixel is not None:
            _draw_axes(canvas, points, seen, to_pixel)
        arm = _ARM * unit / factor
        canvas.lines(_crosses(seen.pixels, arm), _POINT)
        chosen = _corners(points[seen.ids, :2])
        canvas.labels(seen.pixels[chosen], map(str, seen.ids[chosen]), seen.pixels.mean(axis=0))
    return canvas.image


def enlargement(grey: GreyImage) -> int:
    """Return how many times its size an image is shown at, at the bottom left of its picture."""
    return 2 if max(grey.shape) < _SMALL else 1


@dataclass(frozen=True)
class _Canvas:
    """A picture that is drawn on in pixels of the image it shows.

    Attributes:
        image: (height, width, 3) picture.
        factor: Pixels of the picture for a pixel of the image.
        unit: Width of a line, pixels of the picture.
        top: Rows of the picture above the image.
    """

    image: ColourImage
    factor: int
    unit: int
    top: int

    def lines(self, ends: FloatArray, colour: tuple[int, ...], *, closed: bool = False) -> None:
        """Draw (n, k, 2) lines through k points each."""
        whole = list(self._fixed(ends))
        cv2.polylines(
            self.image, whole, closed, colour, self.unit, cv2.LINE_AA, shift=_SUBPIXEL_BITS
        )

    def arrow(self, start: FloatArray, end: FloatArray, colour: tuple[int, ...]) -> None:
        """Draw an arrow between (2,) points."""
        a, b = (self._fixed(each).tolist() for each in (start, end))
        cv2.arrowedLine(
            self.image, a, b, colour, 2 * self.unit, cv2.LINE_AA, _SUBPIXEL_BITS, tipLength=0.1
        )

    def labels(
        self,
        places: FloatArray,
        words: Iterable[str],
        middle: FloatArray,
        colour: tuple[int, ...] = _WORDS,
    ) -> None:
        """Write a word beside each of (n, 2) places, on the side away from a middle."""
        scale, rim = _FONT_SCALE * self.unit, 3 * self.unit
        for place, word in zip(places, words, strict=True):
            away = place - middle
            away = away / max(float(np.hypot(*away)), 1e-9) * 18 * self.unit
            size = np.array(cv2.getTextSize(word, _FONT, scale, self.unit)[0])
            middle_of_word = self._fixed(place) / 2**_SUBPIXEL_BITS + away
            most = np.array(self.image.shape[1::-1]) - size - 2 * rim
            low = np.clip(middle_of_word - size / 2 - rim, [0, self.top], np.maximum(most, 0))
            x, y = np.rint(low).astype(int).tolist()
            wide, high = (size + 2 * rim).tolist()
            cv2.rectangle(self.image, (x, y), (x + wide, y + high), _BAND, cv2.FILLED)
            start = (x + rim, y + high - rim)
            cv2.putText(self.image, word, start, _FONT, scale, colour, self.unit, cv2.LINE_AA)

    def _fixed(self, pixels: FloatArray) -> NDArray[np.int32]:
        """Return (..., 2) pixels of the image as fixed-point ones of the picture."""
        shown = (pixels + 0.5) * self.factor - 0.5 + [0.0, self.top]
        limit = 4.0 * max(self.image.shape)
        fixed = np.rint(np.clip(shown, -limit, limit) * 2**_SUBPIXEL_BITS)
        return np.asarray(fixed, dtype=np.int32)


def _result(station: Station, count: int) -> str:
    seen = station.observation
    if seen is None:
        return printable(station.reason or "not found")
    sigma = "" if seen.sigma_px is None else f", sigma {sigma_text(seen.sigma_px)} px"
    return f"{len(seen.ids)} of {count} points{sigma}"


def _band(text: str, width: int, unit: int) -> ColourImage:
    """Return a dark band of a width with a text on it, on as many lines as it needs."""
    scale, margin = _FONT_SCALE * unit, _MARGIN * unit
    # the font has no other signs
    plain = text.encode("ascii", "replace").decode()
    signs = max(1, (width - 2 * margin) // _text_width("i", scale, unit))
    lines = textwrap.wrap(plain, signs)
    while signs > 1 and max(_text_width(line, scale, unit) for line in lines) > width - 2 * margin:
        signs -= 1
        lines = textwrap.wrap(plain, signs)
    step = round(_LEADING * cv2.getTextSize("Ag", _FONT, scale, unit)[0][1])
    band = np.full((step * len(lines) + margin, width, 3), _BAND, dtype=np.uint8)
    for number, line in enumerate(lines, start=1):
        at = (margin, step * number)
        cv2.putText(band, line, at, _FONT, scale, _WORDS, unit, cv2.LINE_AA)
    return band


def _text_width(text: str, scale: float, unit: int) -> int:
    return int(cv2.getTextSize(text, _FONT, scale, unit)[0][0])


def _below(band: ColourImage, grey: GreyImage, factor: int) -> ColourImage:
    """Return a picture with an image, enlarged without smoothing, below a band."""
    enlarged = grey.repeat(factor, axis=0).repeat(factor, axis=1)
    picture = np.full((len(band) + len(enlarged), band.shape[1], 3), _BAND, dtype=np.uint8)
    picture[: len(band)] = band
    picture[len(band) :, : enlarged.shape[1]] = enlarged[..., None]
    return picture


def _plate_to_pixel(
    points: FloatArray, seen: Observation, camera: Camera | None
) -> PlateToPixel | None:
    """Return the map from the target's plane to pixels, or None for points on one line."""
    plate = points[seen.ids, :2]
    if len(plate) < 4 or np.linalg.matrix_rank(plate - plate[0]) < 2:
        return None
    return plate_map(plate, seen.pixels, camera)


def _draw_axes(
    canvas: _Canvas, points: FloatArray, seen: Observation, to_pixel: PlateToPixel
) -> None:
    """Draw x and y from the seen point that is nearest to point 0."""
    plate = points[seen.ids, :2]
    origin = int(np.argmin(np.linalg.norm(plate - points[0, :2], axis=1)))
    length = _AXIS * float(np.ptp(plate, axis=0).max())
    ends = to_pixel(plate[origin] + length * np.eye(2))
    for end, name, colour in zip(ends, "xy", (_RED, _GREEN), strict=True):
        canvas.arrow(seen.pixels[origin], end, colour)
        canvas.labels(end[None], [name], seen.pixels[origin], colour)


def _rings(discs: FloatArray) -> FloatArray:
    """Return (m, k, 2) points on the edges of discs."""
    angles = 2.0 * np.pi * np.arange(_RING) / _RING
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return np.asarray(discs[:, None, :2] + discs[:, 2, None, None] * circle)


def _crosses(pixels: FloatArray, arm: float) -> FloatArray:
    """Return the (2 n, 2, 2) strokes of crosses at (n, 2) pixels."""
    strokes = arm * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    return np.asarray((pixels[:, None, None] + strokes).reshape(-1, 2, 2))


def _corners(plate: FloatArray) -> IntArray:
    """Return which of (n, 2) points of the plate are farthest out towards its four corners."""
    towards = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return np.unique(np.argmax(plate @ towards.T, axis=0)).astype(np.int64)
