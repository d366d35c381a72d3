"""What a sensor of eight bits makes of light near its limits, black and white.

To leave pixels out that are white would choose them by their noise: near the limit those stay that
it pushed away, and draw the edge. So all pixels stay, and the model is clipped as the sensor clips:
light that falls short of the limit by z standard deviations of its noise is seen, on average, below
the limit by

    noise (z Phi(z) + phi(z))

where phi and Phi are the normal density and distribution. Well beyond the limit that is nothing,
and does not change with the light any more; well within it is the light itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

BLACK, WHITE = 0, 255
_MIDDLE = np.float32((WHITE - BLACK) / 2)
_LEAST = math.sqrt(1.0 / 12.0)
"""Noise of rounding to whole grey levels."""
_FAR = 4.0
"""Standard deviations from the limits within which light is seen as it is."""
_BEYOND = 50.0
"""How far beyond the limits light is thought to be, a standard deviation, in grey levels."""
_FAINT = 0.02
"""Weight of pixels at the limits as long as nothing is known of the light beyond."""
FIRST_NOISE = 2.0
"""What the noise of a grey level is taken for before it is known."""


@dataclass(frozen=True)
class Clipped:
    """How k pixels near the limits show their light.

    Attributes:
        mean: (k,) expected grey levels.
        slope: (k,) their derivatives by the light.
        variance: (k,) of the noise that is left, over that of unclipped pixels.
    """

    mean: SingleArray
    slope: SingleArray
    variance: SingleArray


def at_limits(levels: NDArray[np.uint8]) -> IntArray:
    """Return where grey levels are black or white, counted row by row."""
    # black becomes the largest number of eight bits, white the one below
    return np.flatnonzero(levels - np.uint8(BLACK + 1) >= np.uint8(WHITE - 1))


def fainter(values: SingleArray, at: IntArray) -> SingleArray:
    """Return the same with little weight for the pixels at the limits, counted row by row."""
    out = values.copy()
    out.ravel()[at] *= np.float32(_FAINT)
    return out


def near_limits(light: SingleArray, noise: float) -> NDArray[np.bool_]:
    """Return where light is so near to a limit, or beyond, that it is not seen as it is."""
    return np.asarray(np.abs(light - _MIDDLE) > _MIDDLE - np.float32(_FAR * max(noise, _LEAST)))


def clipped(light: SingleArray, noise: float) -> Clipped:
    """Return how (k,) light is seen whose noise has this standard deviation, in grey levels."""
    scale = np.float32(max(noise, _LEAST))
    inward = np.where(light > _MIDDLE, -1.0, 1.0).astype(np.float32)
    limit = _MIDDLE - inward * _MIDDLE
    room = inward * (light - limit) / scale
    within, density = normal_distribution(room)
    below = room * within + density
    square = within + room * below
    variance = np.maximum(square - below * below, np.float32(0.0))
    return Clipped(limit + inward * scale * below, within, variance)


def clip_model(
    model: SingleArray, slopes: SingleArray, weight: SingleArray, noise: float
) -> FloatArray:
    """Clip modelled grey levels and their derivatives as the sensor does, in place.

    Args:
        model: (n, m) grey levels.
        slopes: (n, p, m) their derivatives.
        weight: (n, m) of the pixels; nothing is done to those without.
        noise: Standard deviation of a grey level.

    Returns:
        (n,) pixels that tell nothing any more, in sum.
    """
    near = np.flatnonzero(near_limits(model, noise) & (weight > 0.0))
    row, pixel = np.divmod(near, model.shape[1])
    seen = clipped(model[row, pixel], noise)
    model[row, pixel] = seen.mean
    slopes[row, :, pixel] *= seen.slope[:, None]
    return np.asarray(np.bincount(row, 1.0 - seen.variance, len(model)))


def held_within(
    normal: FloatArray,
    wanted: FloatArray,
    state: FloatArray,
    light_and_ink: tuple[int, int],
    noise: float,
) -> tuple[FloatArray, FloatArray]:
    """Return normal equations with the knowledge that light is not far beyond the limits.

    Where edges are sharp hardly a pixel shows how bright the light is that the sensor clips.

    Args:
        normal: (n, p, p) normal matrices, for grey levels.
        wanted: (n, p) their right hand sides.
        state: (n, p) where they were taken.
        light_and_ink: Which parameters are the light, and the share of it that dark parts show.
        noise: Standard deviation of a grey level.
    """
    light, ink = state[:, light_and_ink].T
    one, zero = np.ones_like(light), np.zeros_like(light)
    levels = np.stack([light, light * ink], axis=-1)
    slopes = np.stack([np.stack([one, zero], axis=-1), np.stack([ink, light], axis=-1)], axis=1)
    return levels_held((normal, wanted), levels, slopes, light_and_ink, noise)


def levels_held(
    equations: tuple[FloatArray, FloatArray],
    levels: FloatArray,
    slopes: FloatArray,
    parameters: tuple[int, int],
    noise: float,
) -> tuple[FloatArray, FloatArray]:
    """Return normal equations with the knowledge that k levels are not far beyond the limits.

    Args:
        equations: (n, p, p) normal matrices, for grey levels, and (n, p) their right hand sides.
        levels: (n, k) grey levels, of dark and light parts.
        slopes: (n, k, 2) their derivatives by two parameters.
        parameters: Which parameters these are.
        noise: Standard deviation of a grey level.
    """
    beyond = levels - np.clip(levels, BLACK, WHITE)
    slopes = slopes * (beyond[..., None] != 0.0)
    weighted = (noise / _BEYOND) ** 2 * np.swapaxes(slopes, -1, -2)
    normal, wanted = (part.copy() for part in equations)
    normal[np.ix_(range(len(normal)), parameters, parameters)] += weighted @ slopes
    wanted[:, parameters] -= (weighted @ beyond[..., None])[..., 0]
    return normal, wanted
