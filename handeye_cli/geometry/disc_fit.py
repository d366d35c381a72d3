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

from handeye_cli.geometry.blurred_edge import normal_distribution
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_edges import Edges, measure
from handeye_cli.geometry.disc_paper import Patchwork, paper_between
from handeye_cli.geometry.disc_pixels import (
    FloatArray,
    SingleArray,
    edge_pixels,
    forward_jacobian,
    look_at,
)
from handeye_cli.geometry.disc_projection import outlines
from handeye_cli.geometry.light_slopes import Course, Light, course_of_light

_FIRST_BLUR = 0.8
_FIRST_BAND = 3.0
_FIRST_THINNING = 3
"""The first round takes every third pixel within this distance from the edge."""
_BAND_BLURS = 2.4
_WIDE_BLURS = 3.2
_BAND_LIMITS = (1.6, 9.0)
"""Then all pixels within this multiple of the blur take part, more where shadows fall for they tell
the course of the light; and the band's limits."""
_WINDOW_BAND = 5.0
_SLACK = 0.4
"""By how much a disc may move between the rounds, in pixels, without losing pixels."""
_BLUR_LIMITS = (0.3, 4.0)
_FIRST_STEPS, _LAST_STEPS = 2, 2
_GROWTH, _BLUR, _INK, _LIGHT = 2, 3, 4, 5
_SHIFT, _COURSE = slice(0, 2), slice(6, None)
_EVEN, _BENT = 3, 6
"""Terms of the light over a disc: a plane, or a quadratic where shadows fall."""
_SOUND = 9.0
"""Squared residuals over the median above which a disc is covered or stained."""
_MISSES = 1.5
"""Mean square residual over the noise that chance does not explain."""
_STILL = 0.02
"""After a step by fewer blurs nothing is left to the next one."""
_LARGEST_STEP = np.array([0.2, 0.2, 0.1, 0.3, 0.5, *[1e9] * _BENT])


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
        state: (n, p) parameters: shift, growth, blur, ink, and the terms of the light.
        normal: (n, p, p) information on them, for residuals of one grey level.
        squares: (n,) sums of squared residuals.
        count: (n,) pixels that take part.
    """

    state: FloatArray
    normal: FloatArray
    squares: FloatArray
    count: FloatArray

    @property
    def relative(self) -> FloatArray:
        """(n,) mean square residuals."""
        return np.asarray(self.squares / np.maximum(self.count - self.state.shape[1], 1.0))

    @property
    def sound(self) -> NDArray[np.bool_]:
        """(n,) whether a disc is neither covered nor stained."""
        return np.asarray(self.relative < _SOUND * np.median(self.relative))

    @property
    def noise(self) -> float:
        """Variance of a grey level, that of rounding at least."""
        freedom = np.sum((self.count - self.state.shape[1])[self.sound])
        return max(float(np.sum(self.squares[self.sound]) / max(freedom, 1.0)), 1.0 / 12.0)


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
    moved, blur = first.state[:, :3], float(np.median(first.state[:, _BLUR]))
    paper = paper_between(image, discs, to_pixel, _BAND_BLURS * blur)
    prior = _light_prior(first, start, paper, patches.half)
    bent = np.zeros((len(discs), prior.mean.shape[1] - 2))
    wide = _WIDE_BLURS if bent.size > 0 else _BAND_BLURS
    band = min(max(wide * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])
    pixels = edge_pixels(image, patches, outlines(discs, to_pixel, moved) + missed, band)
    edges = measure(patches, pixels, moved, blur=blur, band=band)
    origin = np.concatenate([still, first.state[:, 3:], bent], axis=1)
    return _result(discs, to_pixel, start, moved, _iterate(edges, origin, prior, _LAST_STEPS))


def _result(
    discs: FloatArray, to_pixel: PlateToPixel, start: FloatArray, moved: FloatArray, last: _Progress
) -> DiscFit:
    state, relative = last.state, last.relative
    # where the model misses something the centre is less sure than the noise alone leaves it
    variance = last.noise * np.where(relative > _MISSES * last.noise, relative / last.noise, 1.0)
    radius = discs[:, 2:]
    centre = discs[:, :2] + radius * (state[:, _SHIFT] + moved[:, _SHIFT])
    by_shift = radius[..., None] * forward_jacobian(to_pixel, centre, discs[:, 2])
    spread = np.linalg.inv(last.normal)[:, _SHIFT, _SHIFT]
    return DiscFit(
        pixels=to_pixel(centre) + start - to_pixel(discs[:, :2]),
        covariance=variance[:, None, None] * by_shift @ spread @ np.swapaxes(by_shift, -1, -2),
        noise=math.sqrt(last.noise),
        growth=state[:, _GROWTH] + moved[:, _GROWTH],
        blur=state[:, _BLUR],
        contrast=state[:, _LIGHT] * (1.0 - state[:, _INK]),
        misfit=relative / max(float(np.median(relative)), 1e-300),
    )


@dataclass(frozen=True)
class _Shading:
    """What the pixels should be, and what it is made of: (n, m) each.

    Attributes:
        distance: From the edge, pixels, positive inside.
        covered: Share that discs cover.
        density: Of the normal distribution at the edge, in blurs.
        light: Grey level of paper.
        paper: Share of the light that discs leave.
    """

    distance: SingleArray
    covered: SingleArray
    density: SingleArray
    light: SingleArray
    paper: SingleArray


def _shading(edges: Edges, state: FloatArray) -> _Shading:
    single = state.astype(np.float32)
    blur, ink = single[:, _BLUR, None], single[:, _INK, None]
    terms = edges.pixels.terms[:, : state.shape[1] - _LIGHT]
    distance: SingleArray = edges.distance + (single[:, None, :3] @ edges.by_shift)[:, 0]
    covered, density = normal_distribution(distance / blur)
    if edges.others is not None:
        covered += normal_distribution(edges.others / blur)[0]
    light = (single[:, None, _LIGHT:] @ terms)[:, 0]
    return _Shading(distance, covered, density, light, 1.0 - (1.0 - ink) * covered)


def _left(edges: Edges, shading: _Shading) -> SingleArray:
    """Return the (n, m) residuals."""
    return (edges.pixels.grey - shading.light * shading.paper) * edges.weight


def _linearised(edges: Edges, shading: _Shading, state: FloatArray) -> SingleArray:
    """Return (n, p + 1, m): derivatives of the grey levels by the parameters, and the residuals."""
    single = state.astype(np.float32)
    blur, ink = single[:, _BLUR, None], single[:, _INK, None]
    terms = edges.pixels.terms[:, : state.shape[1] - _LIGHT]
    light = shading.light * edges.weight
    by_distance = light * shading.density * ((ink - 1.0) / blur)
    rows = np.empty((len(state), state.shape[1] + 1, light.shape[1]), dtype=np.float32)
    np.multiply(edges.by_shift, by_distance[:, None], out=rows[:, :3])
    np.multiply(by_distance, shading.distance / -blur, out=rows[:, _BLUR])
    np.multiply(light, shading.covered, out=rows[:, _INK])
    np.multiply(terms, (shading.paper * edges.weight)[:, None], out=rows[:, _LIGHT:-1])
    rows[:, -1] = _left(edges, shading)
    return rows


def _first_state(edges: Edges) -> FloatArray:
    """Return the (n, p) state at the start, light and ink by linear least squares."""
    grey, weight = edges.pixels.grey, edges.weight
    state = np.zeros((len(grey), _LIGHT + _EVEN))
    state[:, _BLUR] = _FIRST_BLUR
    covered, _ = normal_distribution(edges.distance / np.float32(_FIRST_BLUR))
    if edges.others is not None:
        covered += normal_distribution(edges.others / np.float32(_FIRST_BLUR))[0]
    rows = np.stack([np.ones_like(covered), covered], axis=1) * weight[:, None]
    normal = rows @ np.swapaxes(rows, -1, -2) + 1e-6 * np.eye(2)
    light, drop = np.linalg.solve(normal, rows @ grey[..., None])[..., 0].T
    state[:, _LIGHT] = np.maximum(light, 1.0)
    state[:, _INK] = 1.0 + drop / state[:, _LIGHT]
    return state


def _light_prior(first: _Progress, start: FloatArray, paper: Patchwork, half: int) -> Course:
    """Return how the light should go over each disc, in terms of the window's offsets.

    Its variances are in units of that of a grey level.
    """
    sound, noise = first.sound, first.noise
    spread = noise * np.linalg.inv(first.normal)[sound, _LIGHT, _LIGHT]
    light = Light(
        np.concatenate([start[sound], paper.places]) / half,
        np.concatenate([first.state[sound, _LIGHT], paper.level]),
        np.concatenate([spread, np.full(len(paper.level), noise / paper.count)]),
        np.repeat([True, False], [int(sound.sum()), len(paper.level)]),
    )
    course = course_of_light(light, start / half)
    return Course(course.mean, course.variance / noise)


def _iterate(edges: Edges, state: FloatArray, prior: Course | None, steps: int) -> _Progress:
    """Take Gauss-Newton steps, up to so many and until the discs stay where they are.

    The prior's variance is in units of that of a grey level.
    """
    blur = float(np.median(state[:, _BLUR]))
    shading = _shading(edges, state)
    for _ in range(steps):
        rows = _linearised(edges, shading, state)
        products = (rows[:, :-1] @ np.swapaxes(rows, -1, -2)).astype(float)
        normal, wanted = products[..., :-1].copy(), products[..., -1]
        diagonal = np.einsum("nii->ni", normal)
        if prior is not None:
            diagonal[:, _COURSE] += 1.0 / prior.variance
            wanted[:, _COURSE] += (prior.mean - state[:, _COURSE]) / prior.variance
        damped = normal + 1e-6 * np.eye(diagonal.shape[1]) * (diagonal[:, None] + 1e-9)
        step = np.linalg.solve(damped, wanted[..., None])[..., 0]
        largest = _LARGEST_STEP[: step.shape[1]]
        step = np.clip(step, -largest, largest)
        state = state + step
        state[:, _BLUR] = np.clip(state[:, _BLUR], *_BLUR_LIMITS)
        shading = _shading(edges, state)
        if np.max(np.abs(step[:, _SHIFT])) * edges.pixels.half < _STILL * blur:
            break
    left = _left(edges, shading)
    count = np.sum(edges.weight, axis=1, dtype=float)
    return _Progress(state, normal, np.vecdot(left, left).astype(float), count)
