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
from handeye_cli.geometry.disc_pixels import (
    EdgePixels,
    FloatArray,
    SingleArray,
    Windows,
    cut_windows,
    edge_pixels,
    forward_jacobian,
)

_FIRST_BLUR = 0.8
_FIRST_BAND = 3.0
_FIRST_THINNING = 3
"""The first round takes every third pixel within this distance from the edge."""
_BAND_BLURS = 2.8
_BAND_LIMITS = (2.0, 9.0)
"""Then all pixels within this multiple of the blur take part, and the band's limits."""
_WINDOW_BAND = 5.0
_SLACK = 0.7
"""By how much a disc may move between the rounds, in pixels, without losing pixels."""
_BLUR_LIMITS = (0.3, 4.0)
_FIRST_STEPS, _LAST_STEPS = 3, 2
_GROWTH, _BLUR, _LIGHT, _INK = 2, 3, 4, 7
_SHIFT, _SLOPE = slice(0, 2), slice(5, 7)
_PARAMETERS = 8
_SOUND = 9.0
"""Squared residuals over the median above which a disc is covered or stained."""
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
class _Edges:
    """Pixels with their distances from the edge, linearised in shift and growth.

    Attributes:
        pixels: The pixels.
        weight: (n, m) 1 for a pixel that takes part, else 0.
        distance: (n, m) from the edge, pixels, positive inside.
        by_shift: (n, 3, m) derivative of the distance by shift and growth, in radii.
        others: (n, m) share covered by other discs, or None where they are far.
    """

    pixels: EdgePixels
    weight: SingleArray
    distance: SingleArray
    by_shift: SingleArray
    others: SingleArray | None


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
    windows = cut_windows(image, discs, to_pixel, start, _WINDOW_BAND)
    still = np.zeros((len(discs), 3))
    pixels = edge_pixels(windows, still, _FIRST_BAND + _SLACK)
    edges = _edges(windows, pixels.thinned(_FIRST_THINNING), still, _FIRST_BLUR, _FIRST_BAND)
    first, _, squares = _iterate(edges, _first_state(edges), None, _FIRST_STEPS)
    prior = _light_prior(start, first, squares < _SOUND * np.median(squares), windows.half)
    moved, blur = first[:, :3], float(np.median(first[:, _BLUR]))
    band = min(max(_BAND_BLURS * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])
    if band > _FIRST_BAND:
        pixels = edge_pixels(windows, moved, band)
    edges = _edges(windows, pixels, moved, blur, band)
    origin = np.concatenate([np.zeros((len(discs), 3)), first[:, 3:]], axis=1)
    state, normal, squares = _iterate(edges, origin, prior, _LAST_STEPS)
    state[:, :3] += moved
    count = edges.weight.sum(axis=1, dtype=float)
    variance = float(np.sum(squares) / max(np.sum(count) - _PARAMETERS * len(discs), 1.0))
    relative = squares / np.maximum(count, 1.0)
    shift = discs[:, 2:] * state[:, _SHIFT]
    by_shift = discs[:, 2, None, None] * forward_jacobian(
        to_pixel, discs[:, :2] + shift, discs[:, 2]
    )
    spread = by_shift @ np.linalg.inv(normal)[:, _SHIFT, _SHIFT] @ np.swapaxes(by_shift, -1, -2)
    return DiscFit(
        pixels=to_pixel(discs[:, :2] + shift) + start - to_pixel(discs[:, :2]),
        covariance=variance * spread,
        noise=math.sqrt(variance),
        growth=state[:, _GROWTH],
        blur=state[:, _BLUR],
        contrast=state[:, _LIGHT] * (1.0 - state[:, _INK]),
        misfit=relative / max(float(np.median(relative)), 1e-300),
    )


def _edges(
    windows: Windows, pixels: EdgePixels, moved: FloatArray, blur: float, band: float
) -> _Edges:
    """Measure distances from the edges of discs shifted and grown by `moved` (n, 3), in radii."""
    away = pixels.plate - moved[:, _SHIFT, None].astype(np.float32)
    length = np.maximum(np.sqrt(away[:, 0] ** 2 + away[:, 1] ** 2), np.float32(1e-6))
    outward = away / length[:, None]
    across_u = outward[:, 0] * pixels.slopes[:, 0] + outward[:, 1] * pixels.slopes[:, 1]
    across_v = outward[:, 0] * pixels.slopes[:, 2] + outward[:, 1] * pixels.slopes[:, 3]
    scale = 1.0 / np.sqrt(across_u * across_u + across_v * across_v)
    distance = ((1.0 + moved[:, 2:]).astype(np.float32) - length) * scale
    others = None
    if windows.gap < 2.0 * band:
        # A blurred round edge seems smaller than it is, that of the neighbours as much as the own.
        growth = float(np.median(moved[:, 2]))
        others = _others(windows, away, scale, blur, growth)
    return _Edges(
        pixels=pixels,
        weight=pixels.weight * (np.abs(distance) < band),
        distance=distance,
        by_shift=np.concatenate([outward * scale[:, None], scale[:, None]], axis=1),
        others=others,
    )


def _others(
    windows: Windows, away: SingleArray, scale: SingleArray, blur: float, growth: float
) -> SingleArray:
    """Return the (n, m) share that the nearest of the other discs covers.

    `away` is relative to the disc's centre as it was found; the others lie where the plate says.
    """
    nearest = np.full(scale.shape, -np.inf, dtype=np.float32)
    for other in np.moveaxis(windows.others, 1, 0)[..., None]:
        length = np.sqrt((away[:, 0] - other[:, 0]) ** 2 + (away[:, 1] - other[:, 1]) ** 2)
        np.maximum(nearest, np.float32(1.0 + growth) * other[:, 2] - length, out=nearest)
    share, _ = _coverage(nearest * scale / np.float32(blur))
    return share


def _coverage(x: SingleArray) -> tuple[SingleArray, SingleArray]:
    """Return the normal distribution function, to 1e-7, and its density.

    The function is Abramowitz and Stegun's approximation 26.2.17.
    """
    density = np.exp(-0.5 * x * x) * np.float32(1.0 / math.sqrt(2.0 * math.pi))
    t = 1.0 / (1.0 + np.float32(0.2316419) * np.abs(x))
    series = np.float32(1.330274429) * t + np.float32(-1.821255978)
    series = series * t + np.float32(1.781477937)
    series = series * t + np.float32(-0.356563782)
    series = series * t + np.float32(0.319381530)
    tail = density * series * t
    return np.where(x > 0, 1.0 - tail, tail), density


def _model(edges: _Edges, state: FloatArray) -> tuple[SingleArray, SingleArray]:
    """Return the (n, m) grey levels and their (n, 8, m) derivatives."""
    single = state.astype(np.float32)
    blur, ink = single[:, _BLUR, None], single[:, _INK, None]
    offset, by_shift = edges.pixels.offset, edges.by_shift
    distance: SingleArray = edges.distance + (single[:, None, :3] @ by_shift)[:, 0]
    covered, density = _coverage(distance / blur)
    if edges.others is not None:
        covered += edges.others
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


def _first_state(edges: _Edges) -> FloatArray:
    """Return the (n, 8) state at the start, light and ink by linear least squares."""
    grey, weight = edges.pixels.grey, edges.weight
    state = np.zeros((len(grey), _PARAMETERS))
    state[:, _BLUR] = _FIRST_BLUR
    covered, _ = _coverage(edges.distance / np.float32(_FIRST_BLUR))
    covered = covered if edges.others is None else covered + edges.others
    rows = np.stack([np.ones_like(covered), covered], axis=1) * weight[:, None]
    normal = rows @ np.swapaxes(rows, -1, -2) + 1e-6 * np.eye(2)
    light, drop = np.linalg.solve(normal, rows @ grey[..., None])[..., 0].T
    state[:, _LIGHT] = np.maximum(light, 1.0)
    state[:, _INK] = 1.0 + drop / state[:, _LIGHT]
    return state


def _light_prior(
    start: FloatArray, state: FloatArray, sound: NDArray[np.bool_], half: int
) -> tuple[FloatArray, FloatArray]:
    """Return (n, 2) slopes of the light by its course over the plate, and their variances.

    A quadratic is fitted to the light of the sound discs; what it misses, over the distance between
    discs, bounds how far a local slope may depart from it.
    """
    middle = start.mean(axis=0)
    extent = max(float(np.max(np.abs(start - middle))), 1.0)
    x, y = ((start - middle) / extent).T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    terms = terms[sound] if sound.sum() >= 12 else terms[sound, :3]
    course, *_ = np.linalg.lstsq(terms, state[sound, _LIGHT], rcond=None)
    missed = state[sound, _LIGHT] - terms @ course
    spread = float(np.sqrt(np.mean(missed**2))) + 1e-3
    full = np.zeros(6)
    full[: len(course)] = course
    _, a, b, aa, ab, bb = full
    slope = np.stack([a + 2 * aa * x + ab * y, b + ab * x + 2 * bb * y], axis=1)
    apart = np.linalg.norm(start[:, None] - start[None], axis=-1) + np.diag([np.inf] * len(start))
    pitch = float(np.median(np.min(apart, axis=1)))
    return slope * (half / extent), np.full((len(start), 2), (2.0 * spread * half / pitch) ** 2)


def _iterate(
    edges: _Edges, state: FloatArray, prior: tuple[FloatArray, FloatArray] | None, steps: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the state after some Gauss-Newton steps, the normal matrices and squared residuals."""
    grey, weight = edges.pixels.grey, edges.weight
    count = np.maximum(weight.sum(axis=1), 1.0)
    for _ in range(steps):
        model, J = _model(edges, state)
        left = (grey - model) * weight
        J *= weight[:, None]
        normal = (J @ np.swapaxes(J, -1, -2)).astype(float)
        right = (J @ left[..., None])[..., 0].astype(float)
        if prior is not None:
            strength = float(np.median(np.sum(left * left, axis=1) / count)) / prior[1]
            normal[:, [5, 6], [5, 6]] += strength
            right[:, _SLOPE] += strength * (prior[0] - state[:, _SLOPE])
        diagonal = np.einsum("nii->ni", normal)
        damped = normal + 1e-6 * np.eye(_PARAMETERS) * (diagonal[:, None] + 1e-9)
        step = np.linalg.solve(damped, right[..., None])[..., 0]
        state = state + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        state[:, _BLUR] = np.clip(state[:, _BLUR], *_BLUR_LIMITS)
    left = (grey - _model(edges, state)[0]) * weight
    return state, normal, np.sum(left * left, axis=1, dtype=float)
