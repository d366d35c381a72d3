"""Centres of discs by maximum likelihood: the blurred edge of each disc fitted to its pixels.

The image of a disc's centre is not the centre of the ellipse it is imaged as. So the edge is
modelled on the plate, where it is a circle, and carried into the image by the map from plate to
pixels: perspective and lens distortion within each disc are part of the model. All discs of an
image are fitted at once, in single precision, which is far finer than a grey level.

Near disc k the inverse map is a cubic polynomial. With the distance d of a pixel from the edge, in
pixels and positive inside, the disc covers `S = Phi(d / blur)` of it, neighbours add theirs, and

    grey = light (1 - (1 - ink) sum S),   light = p0 + p1 u + p2 v

A slope of the light looks much like a shift; it is tied to the light's course over the plate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_edges import Edges, coverage, measure
from handeye_cli.geometry.disc_pixels import (
    FloatArray,
    SingleArray,
    edge_pixels,
    forward_jacobian,
    look_at,
)
from handeye_cli.geometry.disc_projection import outlines

_FIRST_BLUR = 0.8
_FIRST_BAND = 3.0
_FIRST_THINNING = 3
"""The first round takes every third pixel within this distance from the edge."""
_BAND_BLURS = 2.4
_BAND_LIMITS = (1.6, 9.0)
"""Then all pixels within this multiple of the blur take part, and the band's limits."""
_WINDOW_BAND = 5.0
_SLACK = 0.4
"""By how much a disc may move between the rounds, in pixels, without losing pixels."""
_BLUR_LIMITS = (0.3, 4.0)
_FIRST_STEPS, _LAST_STEPS = 3, 2
_GROWTH, _BLUR, _LIGHT, _INK = 2, 3, 4, 7
_SHIFT, _SLOPE = slice(0, 2), slice(5, 7)
_PARAMETERS = 8
_SMOOTH = 1e-7
"""Least variance of a light's slope over a disc, in squared lights."""
_SOUND = 9.0
"""Squared residuals over the median above which a disc is covered or stained."""
_STILL = 0.02
"""After a step by fewer blurs nothing is left to the next one."""
_LARGEST_STEP = np.array([0.2, 0.2, 0.1, 0.3, 1e9, 1e9, 1e9, 0.5])


@dataclass(frozen=True)
class DiscFit:
    """Fitted discs of one image.

    Attributes:
        pixels: (n, 2) images of the discs' centres.
        covariance: (n, 2, 2) of these from the image noise, square pixels.
        noise: Standard deviation of a grey level, from the residuals.
        growth: (n,) fitted radius over the nominal one, minus 1.
        blur: (n,) standard deviation of the edge, pixels.
        contrast: (n,) grey levels from ink to paper; negative for light discs.
        misfit: (n,) mean square residual of each disc over the median of all.
    """

    pixels: FloatArray
    covariance: FloatArray
    noise: float
    growth: FloatArray
    blur: FloatArray
    contrast: FloatArray
    misfit: FloatArray


@dataclass(frozen=True)
class _Progress:
    """What some steps reached.

    Attributes:
        state: (n, 8) parameters.
        normal: (n, 8, 8) information on them, for residuals of one grey level.
        squares: (n,) sums of squared residuals.
        count: (n,) pixels that take part.
    """

    state: FloatArray
    normal: FloatArray
    squares: FloatArray
    count: FloatArray


def fit_discs(
    image: NDArray[np.uint8], discs: FloatArray, to_pixel: PlateToPixel, start: FloatArray
) -> DiscFit:
    """Fit all discs of a plate in one image.

    Args:
        image: (height, width) grey image.
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        start: (n, 2) first guess of the centres in the image, good to about a pixel.
    """
    missed = (start - to_pixel(discs[:, :2]))[:, None]
    patches = look_at(discs, to_pixel, start, _WINDOW_BAND)
    still = np.zeros((len(discs), 3))
    rings = outlines(discs, to_pixel) + missed
    pixels = edge_pixels(image, patches, rings, _FIRST_BAND + _SLACK, every=_FIRST_THINNING)
    edges = measure(patches, pixels, still, blur=_FIRST_BLUR, band=_FIRST_BAND)
    first = _iterate(edges, _first_state(edges), None, _FIRST_STEPS)
    prior = _light_prior(start, first, patches.half)
    moved, blur = first.state[:, :3], float(np.median(first.state[:, _BLUR]))
    band = min(max(_BAND_BLURS * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])
    pixels = edge_pixels(image, patches, outlines(discs, to_pixel, moved) + missed, band)
    edges = measure(patches, pixels, moved, blur=blur, band=band)
    origin = np.concatenate([np.zeros((len(discs), 3)), first.state[:, 3:]], axis=1)
    return _result(discs, to_pixel, start, moved, _iterate(edges, origin, prior, _LAST_STEPS))


def _result(
    discs: FloatArray, to_pixel: PlateToPixel, start: FloatArray, moved: FloatArray, last: _Progress
) -> DiscFit:
    state, count, squares = last.state, last.count, last.squares
    relative = squares / np.maximum(count - _PARAMETERS, 1.0)
    sound = relative < _SOUND * np.median(relative)
    freedom = max(float(np.sum(count[sound] - _PARAMETERS)), 1.0)
    variance = float(np.sum(squares[sound])) / freedom
    radius = discs[:, 2:]
    centre = discs[:, :2] + radius * (state[:, _SHIFT] + moved[:, _SHIFT])
    by_shift = radius[..., None] * forward_jacobian(to_pixel, centre, discs[:, 2])
    spread = np.linalg.inv(last.normal)[:, _SHIFT, _SHIFT]
    return DiscFit(
        pixels=to_pixel(centre) + start - to_pixel(discs[:, :2]),
        covariance=variance * by_shift @ spread @ np.swapaxes(by_shift, -1, -2),
        noise=math.sqrt(variance),
        growth=state[:, _GROWTH] + moved[:, _GROWTH],
        blur=state[:, _BLUR],
        contrast=state[:, _LIGHT] * (1.0 - state[:, _INK]),
        misfit=relative / max(float(np.median(relative)), 1e-300),
    )


def _model(edges: Edges, state: FloatArray) -> tuple[SingleArray, SingleArray]:
    """Return the (n, m) grey levels and their (n, 8, m) derivatives."""
    single = state.astype(np.float32)
    blur, ink = single[:, _BLUR, None], single[:, _INK, None]
    offset, by_shift = edges.pixels.offset, edges.by_shift
    distance: SingleArray = edges.distance + (single[:, None, :3] @ by_shift)[:, 0]
    covered, density = coverage(distance / blur)
    if edges.others is not None:
        covered += coverage(edges.others / blur)[0]
    light = single[:, _LIGHT, None] + (single[:, None, _SLOPE] @ offset)[:, 0]
    paper = 1.0 - (1.0 - ink) * covered
    by_distance = light * density * ((ink - 1.0) / blur)
    J = np.empty((len(state), _PARAMETERS, distance.shape[1]), dtype=np.float32)
    np.multiply(by_shift, by_distance[:, None], out=J[:, :3])
    np.multiply(by_distance, distance / -blur, out=J[:, _BLUR])
    J[:, _LIGHT] = paper
    np.multiply(offset, paper[:, None], out=J[:, _SLOPE])
    np.multiply(light, covered, out=J[:, _INK])
    return light * paper, J


def _first_state(edges: Edges) -> FloatArray:
    """Return the (n, 8) state at the start, light and ink by linear least squares."""
    grey, weight = edges.pixels.grey, edges.weight
    state = np.zeros((len(grey), _PARAMETERS))
    state[:, _BLUR] = _FIRST_BLUR
    covered, _ = coverage(edges.distance / np.float32(_FIRST_BLUR))
    if edges.others is not None:
        covered += coverage(edges.others / np.float32(_FIRST_BLUR))[0]
    rows = np.stack([np.ones_like(covered), covered], axis=1) * weight[:, None]
    normal = rows @ np.swapaxes(rows, -1, -2) + 1e-6 * np.eye(2)
    light, drop = np.linalg.solve(normal, rows @ grey[..., None])[..., 0].T
    state[:, _LIGHT] = np.maximum(light, 1.0)
    state[:, _INK] = 1.0 + drop / state[:, _LIGHT]
    return state


def _light_prior(start: FloatArray, first: _Progress, half: int) -> tuple[FloatArray, FloatArray]:
    """Return (n, 2) slopes of the light by its course over the plate, and their variance.

    A quadratic is fitted to the light of the sound discs. What it misses beyond the noise, and what
    the slopes that were found depart from its own, bound how far a slope may depart from it.
    """
    sound = first.squares < _SOUND * np.median(first.squares)
    light, slopes = first.state[sound, _LIGHT], first.state[sound, _SLOPE]
    freedom = max(float(np.sum(first.count[sound] - _PARAMETERS)), 1.0)
    noise = float(np.sum(first.squares[sound])) / freedom
    spread = noise * np.einsum("nii->ni", np.linalg.inv(first.normal[sound]))
    middle = start.mean(axis=0)
    extent = max(float(np.max(np.abs(start - middle))), 1.0)
    terms, by_x, by_y = _quadratic((start - middle) / extent)
    used = terms.shape[1] if sound.sum() >= 2 * terms.shape[1] else 3
    rows = terms[sound, :used]
    course, *_ = np.linalg.lstsq(rows, light, rcond=None)
    missed = np.sum((light - rows @ course) ** 2) / max(len(light) - used, 1)
    rough = max(float(missed - np.mean(spread[:, _LIGHT])), 0.0)
    slope = np.stack([by_x[:, :used] @ course, by_y[:, :used] @ course], axis=1) * (half / extent)
    apart = np.sum((start[:, None] - start[None]) ** 2, axis=-1) + np.diag([np.inf] * len(start))
    pitch = float(np.median(np.min(apart, axis=1)))
    departs = (slopes - slope[sound]) ** 2 - spread[:, _SLOPE]
    departure = float(np.mean(departs) - 2.0 * np.std(departs) / math.sqrt(departs.size))
    variance = max(
        4.0 * rough * (half / pitch) ** 2, departure, _SMOOTH * float(np.median(light)) ** 2
    )
    return slope, np.full((len(start), 2), variance)


def _quadratic(at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the (n, 6) terms of a quadratic at (n, 2) places, and their derivatives by each."""
    x, y = at.T
    one, zero = np.ones_like(x), np.zeros_like(x)
    terms = np.stack([one, x, y, x * x, x * y, y * y], axis=1)
    by_x = np.stack([zero, one, zero, 2 * x, y, zero], axis=1)
    return terms, by_x, np.stack([zero, zero, one, zero, x, 2 * y], axis=1)


def _iterate(
    edges: Edges, state: FloatArray, prior: tuple[FloatArray, FloatArray] | None, steps: int
) -> _Progress:
    """Take Gauss-Newton steps, up to so many and until the discs stay where they are."""
    grey, weight = edges.pixels.grey, edges.weight
    count, blur = np.sum(weight, axis=1, dtype=float), float(np.median(state[:, _BLUR]))
    for _ in range(steps):
        model, J = _model(edges, state)
        left = (grey - model) * weight
        # of an array and itself the product would be slower
        normal = ((J * weight[:, None]) @ np.swapaxes(J, -1, -2)).astype(float)
        right = (J @ left[..., None])[..., 0].astype(float)
        squares = np.vecdot(left, left).astype(float)
        wanted = right.copy()
        if prior is not None:
            strength = float(np.median(squares / np.maximum(count, 1.0))) / prior[1]
            normal[:, [5, 6], [5, 6]] += strength
            wanted[:, _SLOPE] += strength * (prior[0] - state[:, _SLOPE])
        diagonal = np.einsum("nii->ni", normal)
        damped = normal + 1e-6 * np.eye(_PARAMETERS) * (diagonal[:, None] + 1e-9)
        step = np.linalg.solve(damped, wanted[..., None])[..., 0]
        step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        state = state + step
        state[:, _BLUR] = np.clip(state[:, _BLUR], *_BLUR_LIMITS)
        # what the linear model leaves, for the next model is not asked for
        squares += np.einsum("ni,ni->n", step, (normal @ step[..., None])[..., 0] - 2.0 * right)
        if np.max(np.abs(step[:, _SHIFT])) * edges.pixels.half < _STILL * blur:
            break
    return _Progress(state, normal, np.maximum(squares, 0.0), count)
