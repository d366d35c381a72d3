"""Corners of chessboards by maximum likelihood: the blurred saddle fitted to its pixels.

Two edges of the board cross in a corner, and the squares between them are dark and light in turn.
With the signed distances d_x, d_y of a pixel from the two edges, in pixels, and the blur b of the
edges, the share of dark less the share of light in a pixel is T = `crossing(d_x / b, d_y / b)`. Ink
that spreads and a camera that is not linear add s (1 - T^2), which widens the squares of one kind:

    grey = light (1 - contrast (T + s (1 - T^2))),   light = p0 + p1 u + p2 v

All this but the slope of the light looks the same after half a turn about the corner, and a shift
looks opposite: what the model misses of blur, ink and angles does not move the corner. The slope
looks much like a shift; it is tied to the course of the light over the board. Grey levels are
clipped where the sensor clips. All corners of an image are fitted at once, in single precision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray, crossing
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.corner_pixels import (
    CornerPixels,
    Crossings,
    FloatArray,
    corner_pixels,
    crossings,
)
from handeye_cli.geometry.light_slopes import Light, course_of_light
from handeye_cli.geometry.sensor_limits import (
    FIRST_NOISE,
    clip_model,
    fainter,
    levels_held,
)

_FIRST_BLUR = 0.8
_FIRST_BAND = 3.0
_FEW = 90
"""The first round thins the pixels of a corner to about so many."""
_BAND_BLURS = 2.8
_BAND_LIMITS = (2.0, 9.0)
"""In the end the pixels within this multiple of the blur take part, and the band's limits."""
_SLACK = 1.0
"""By how much a corner may move in the first round, in pixels, without losing pixels."""
_CORE_BLURS = 4.5
"""Beyond this distance from one edge only the other is seen."""
_CLEAR_BLURS = 3.0
"""How far what is printed in a light square is seen."""
_BLUR_LIMITS = (0.3, 4.0)
_FIRST_STEPS, _LAST_STEPS, _STEPS_CLIPPED = 3, 2, 8
_AT_REST = 0.002
"""After a step by fewer pixels a fit of clipped light ends, too."""
_STEEPEST = 0.2
"""Likely change of the light over half a window, before its course is known."""
_ROUNDING = 1.0 / 12.0
"""Variance of rounding to whole grey levels."""
_SOUND = 9.0
"""Squared residuals over the median above which a corner is covered or stained."""
_PLANE = 4
"""Corners that a course of the light needs."""
_SHIFT, _SLOPE = slice(0, 2), slice(4, 6)
_BLUR, _LIGHT, _CONTRAST, _SPREAD = 2, 3, 6, 7
_PARAMETERS = 8
_LARGEST_STEP = np.array([0.8, 0.8, 0.3, 1e9, 1e9, 1e9, 0.5, 0.2])


@dataclass(frozen=True)
class CornerFit:
    """Fitted corners of one image.

    Attributes:
        pixels: (n, 2) the corners.
        covariance: (n, 2, 2) of these from the image noise, square pixels.
        noise: Standard deviation of a grey level, from the residuals.
        blur: (n,) standard deviation of the edges, pixels.
        contrast: (n,) grey levels between the squares, positive where those with x y > 0 are dark.
        misfit: (n,) mean square residual of each corner over the median of all.
    """

    pixels: FloatArray
    covariance: FloatArray
    noise: float
    blur: FloatArray
    contrast: FloatArray
    misfit: FloatArray


@dataclass(frozen=True)
class _Progress:
    """What some steps reached.

    Attributes:
        state: (n, 8) parameters.
        normal: (n, 8, 8) information on them, for residuals of one grey level.
        squares: (n,) sums of squared residuals before the last step, which is small.
        count: (n,) pixels that take part and tell of the light.
    """

    state: FloatArray
    normal: FloatArray
    squares: FloatArray
    count: FloatArray

    @property
    def variances(self) -> FloatArray:
        """(n,) mean squares of the residuals, at least those of rounding to whole grey levels."""
        return np.maximum(self.squares / np.maximum(self.count - _PARAMETERS, 1.0), _ROUNDING)

    @property
    def sound(self) -> NDArray[np.bool_]:
        """(n,) corners in the image that are neither covered nor stained."""
        whole = self.count > 2 * _PARAMETERS
        typical = np.median(self.variances[whole]) if np.any(whole) else _ROUNDING
        return np.asarray(whole & (self.variances <= _SOUND * typical))


@dataclass(frozen=True)
class _Prior:
    """What is known of the light's slopes beforehand: (n, 2) means and their variances."""

    mean: FloatArray
    variance: FloatArray


def fit_corners(
    image: NDArray[np.uint8],
    corners: FloatArray,
    square: float,
    to_pixel: PlateToPixel,
    start: FloatArray,
    *,
    gap: float | None = None,
) -> CornerFit:
    """Fit all corners of a board in one image.

    Args:
        image: (height, width) grey image.
        corners: (n, 2) corners on the board, metres; its edges are parallel to the axes.
        square: Side of a square, metres.
        to_pixel: Map of (..., 2) board points to (..., 2) pixels.
        start: (n, 2) first guess of the corners in the image, good to about a pixel.
        gap: Width of the margin around what is printed in the light squares, metres, or None when
            nothing is.
    """
    seen = crossings(corners, square, to_pixel, start)
    gap = None if gap is None else gap / square
    pixels = corner_pixels(image, seen, _FIRST_BAND + _SLACK)
    few = pixels.thinned(max(1, pixels.grey.shape[1] // _FEW))
    few = _free(few.within(_FIRST_BAND, np.zeros(start.shape)), seen, _FIRST_BLUR, gap)
    state = _first_state(few)
    first = _iterate(few, seen.shear, state, _steep_prior(state), _FIRST_STEPS)
    blur = float(np.median(first.state[:, _BLUR]))
    band = min(max(_BAND_BLURS * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])
    if band > _FIRST_BAND:
        pixels = corner_pixels(image, seen, band + _SLACK)
    pixels = _free(pixels.within(band, first.state[:, _SHIFT]), seen, blur, gap)
    prior = _light_prior(pixels.middle, first)
    return _result(seen, _iterate(pixels, seen.shear, first.state, prior, _LAST_STEPS))


def _free(pixels: CornerPixels, seen: Crossings, blur: float, gap: float | None) -> CornerPixels:
    return pixels if gap is None else pixels.beside_prints(seen, gap, _CLEAR_BLURS * blur)


def _steep_prior(state: FloatArray) -> _Prior:
    return _Prior(np.zeros((len(state), 2)), (_STEEPEST * state[:, _LIGHT, None]) ** 2)


def _light_prior(middle: FloatArray, first: _Progress) -> _Prior:
    """Return what the course of the light over the board says of its slopes in the windows."""
    sound, level = first.sound, first.state[:, _LIGHT]
    if np.sum(sound) < _PLANE:
        return _steep_prior(first.state)
    variance = first.variances * np.linalg.inv(first.normal)[:, _LIGHT, _LIGHT]
    plain = np.zeros(int(np.sum(sound)), dtype=bool)
    light = Light(middle[sound], level[sound], variance[sound], fitted=plain)
    course = course_of_light(light, middle)
    return _Prior(course.mean[:, :2], course.variance[:, :2])


def _result(seen: Crossings, last: _Progress) -> CornerFit:
    state, sound = last.state, last.sound
    freedom = max(float(np.sum(last.count[sound] - _PARAMETERS)), 1.0)
    variance = max(float(np.sum(last.squares[sound])) / freedom, _ROUNDING)
    to_image = np.linalg.inv(seen.normals)
    spread = np.linalg.inv(last.normal)[:, _SHIFT, _SHIFT]
    return CornerFit(
        pixels=seen.start + (to_image @ state[:, _SHIFT, None])[..., 0],
        covariance=variance * to_image @ spread @ np.swapaxes(to_image, -1, -2),
        noise=math.sqrt(variance),
        blur=state[:, _BLUR],
        contrast=2.0 * state[:, _LIGHT] * state[:, _CONTRAST],
        misfit=last.variances / float(np.median(last.variances)),
    )


def _model(
    pixels: CornerPixels, shear: SingleArray, state: FloatArray, core: int
) -> tuple[SingleArray, SingleArray]:
    """Return the (n, m) grey levels and their (n, 8, m) derivatives."""
    single = state.astype(np.float32)
    blur, contrast = single[:, _BLUR, None], single[:, _CONTRAST, None]
    scaled = np.moveaxis((pixels.distance - single[:, _SHIFT, None]) / blur[..., None], 1, 0)
    T, slopes = crossing(scaled, shear, core)
    spread = single[:, _SPREAD, None]
    between = 1.0 - T * T
    profile = T + spread * between
    shade = 1.0 - contrast * profile
    light = single[:, _LIGHT, None] + (single[:, None, _SLOPE] @ pixels.offset)[:, 0]
    by_T = light * contrast * (1.0 - 2.0 * spread * T) / blur
    J = np.empty((len(state), _PARAMETERS, T.shape[1]), dtype=np.float32)
    np.multiply(by_T, slopes[0], out=J[:, 0])
    np.multiply(by_T, slopes[1], out=J[:, 1])
    np.add(J[:, 0] * scaled[0], J[:, 1] * scaled[1], out=J[:, _BLUR])
    J[:, _LIGHT] = shade
    np.multiply(pixels.offset, shade[:, None], out=J[:, _SLOPE])
    np.multiply(-light, profile, out=J[:, _CONTRAST])
    np.multiply(-light * contrast, between, out=J[:, _SPREAD])
    return light * shade, J


def _first_state(pixels: CornerPixels) -> FloatArray:
    """Return the (n, 8) state at the start, light and contrast by linear least squares."""
    state = np.zeros((len(pixels.grey), _PARAMETERS))
    state[:, _BLUR] = _FIRST_BLUR
    ramps = np.clip(pixels.distance / np.float32(_FIRST_BLUR), -1.0, 1.0)
    T = ramps[:, 0] * ramps[:, 1]
    weight = fainter(pixels.weight, pixels.at_limits)
    rows = np.stack([np.ones_like(T), T], axis=1) * weight[:, None]
    normal = rows @ np.swapaxes(rows, -1, -2) + 1e-6 * np.eye(2)
    right = rows @ (weight * pixels.grey)[..., None]
    light, drop = np.linalg.solve(normal, right)[..., 0].T
    state[:, _LIGHT] = np.maximum(light, 1.0)
    state[:, _CONTRAST] = -drop / state[:, _LIGHT]
    return state


def _iterate(
    pixels: CornerPixels, shear: SingleArray, state: FloatArray, prior: _Prior, steps: int
) -> _Progress:
    """Take some Gauss-Newton steps, more where light beyond the sensor's limits comes to rest."""
    weight, whole = pixels.weight, np.sum(pixels.weight, axis=1, dtype=float)
    count, noise = whole, FIRST_NOISE**2
    core = pixels.core(_SLACK + _CORE_BLURS * float(np.median(state[:, _BLUR])))
    strength = np.broadcast_to(1.0 / prior.variance, prior.mean.shape)
    for number in range(_STEPS_CLIPPED if pixels.clipped else steps):
        model, J = _model(pixels, shear, state, core)
        if pixels.clipped:
            count = np.maximum(whole - clip_model(model, J, weight, math.sqrt(noise)), 1.0)
        left = (pixels.grey - model) * weight
        J *= weight[:, None]
        squares = np.sum(left * left, axis=1, dtype=float)
        noise = float(np.median(squares / np.maximum(count, 1.0))) + 1e-3
        normal = (J @ np.swapaxes(J, -1, -2)).astype(float)
        right = (J @ left[..., None])[..., 0].astype(float)
        if pixels.clipped:
            normal, right = _held(normal, right, state, math.sqrt(noise))
        normal[:, [4, 5], [4, 5]] += noise * strength
        right[:, _SLOPE] += noise * strength * (prior.mean - state[:, _SLOPE])
        normal += 1e-6 * np.eye(_PARAMETERS) * (np.einsum("nii->ni", normal)[:, None] + 1e-9)
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        state = state + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        state[:, _BLUR] = np.clip(state[:, _BLUR], *_BLUR_LIMITS)
        if number + 1 >= steps and np.max(np.abs(step[:, _SHIFT])) < _AT_REST:
            break
    return _Progress(state, normal, squares, count)


def _held(
    normal: FloatArray, right: FloatArray, state: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Return normal equations that know that no square is far beyond the sensor's limits."""
    light, contrast = state[:, _LIGHT], state[:, _CONTRAST]
    levels = np.stack([light * (1.0 + contrast), light * (1.0 - contrast)], axis=-1)
    by_light = np.stack([1.0 + contrast, 1.0 - contrast], axis=-1)
    slopes = np.stack([by_light, np.stack([light, -light], axis=-1)], axis=-1)
    return levels_held((normal, right), levels, slopes, (_LIGHT, _CONTRAST), noise)
