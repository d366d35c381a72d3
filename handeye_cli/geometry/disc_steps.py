"""Gauss-Newton steps to the edges of discs, all discs of an image at once.

With the distance d of a pixel from the edge, in pixels and positive inside, the disc covers
`S = Phi(d / blur)` of it, neighbours add theirs, and

    grey = light (1 - (1 - ink) sum S),   light = p0 + p1 u + p2 v

with quadratic terms where shadows fall, clipped where the sensor clips. Single precision is far
finer than a grey level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.disc_edges import Edges, combined
from handeye_cli.geometry.disc_pixels import FloatArray, SingleArray
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.sensor_limits import clipped, fainter, held_within, near_limits

GROWTH, BLUR, INK, LIGHT = 2, 3, 4, 5
SHIFT, COURSE = slice(0, 2), slice(6, None)
"""Where the parameters of a disc are; the terms of its light come last."""
_EVEN, _BENT = 3, 6
"""Terms of the light over a disc: a plane, or a quadratic where shadows fall."""
KEPT = (0, 1, LIGHT)
KEPT_SHIFT, KEPT_LIGHT = slice(0, 2), 2
"""Parameters whose covariances are kept, and where."""
LEAST_VARIANCE = 1.0 / 12.0
"""Variance of a grey level that rounding alone leaves."""
_DAMPING = 1e-6
_SOUND = 9.0
"""Squared residuals over the median above which a disc is covered or stained."""
_STILL_AT_FIRST, _STILL = 0.03, 0.07
"""After a step by fewer blurs next to nothing is left to another one; what the first round takes
the blur and the light for stays."""
_MOST_STEPS, _MOST_STEPS_CLIPPED = 2, 10
_LIGHT_STILL = 0.2
"""Light beyond the limits of the sensor comes to rest slowly: to this share of the noise."""
_BLUR_LIMITS = (0.3, 4.0)
_LARGEST_STEP = np.array([0.2, 0.2, 0.1, 0.3, 0.5, *[1e9] * _BENT])


@dataclass(frozen=True)
class Prior:
    """What is known beforehand of the parameters of n discs but for their shifts.

    Attributes:
        mean: (n, p - 2) expected values.
        precision: (n, p - 2) the variance of a grey level over those of the parameters; 0 where
            nothing is known.
    """

    mean: FloatArray
    precision: FloatArray

    @property
    def bent(self) -> bool:
        """Whether the light bends within a disc."""
        return bool(self.mean.shape[1] > LIGHT + _EVEN - GROWTH)


@dataclass(frozen=True)
class Progress:
    """What a step reached.

    Attributes:
        state: (n, p) parameters: shift, growth, blur, ink, and the terms of the light.
        spread: (n, p, 3) their covariances with the shift and the light's first term, for residuals
            of one grey level.
        squares: (n,) sums of squared residuals, as the step foretells them.
        count: (n,) pixels that take part.
    """

    state: FloatArray
    spread: FloatArray
    squares: FloatArray
    count: FloatArray

    @cached_property
    def relative(self) -> FloatArray:
        """(n,) mean square residuals."""
        return np.asarray(self.squares / np.maximum(self.count - self.state.shape[1], 1.0))

    @cached_property
    def sound(self) -> NDArray[np.bool_]:
        """(n,) whether a disc is neither covered nor stained."""
        return np.asarray(self.relative < _SOUND * typical(self.relative))

    @cached_property
    def variance(self) -> float:
        """Variance of a grey level, that of rounding at least."""
        sound = self.sound.astype(float)
        freedom = sound @ (self.count - self.state.shape[1])
        return max(float(sound @ self.squares / max(freedom, 1.0)), LEAST_VARIANCE)

    @cached_property
    def blur(self) -> float:
        """Typical blur, pixels."""
        return typical(self.state[:, BLUR])


def first_state(edges: Edges, blur: float) -> FloatArray:
    """Return the (n, p) state at the start, in an even light, from the blur that edges may have.

    With light 1 and ink 0 the model has the derivatives it has with any, but for factors.
    """
    state = np.zeros((len(edges.grey), LIGHT + _EVEN))
    state[:, BLUR], state[:, LIGHT] = blur, 1.0
    if edges.clipped:
        at = edges.at_limits
        edges = replace(edges, weight=fainter(edges.weight, at), grey=fainter(edges.grey, at))
    normal, wanted, _ = normal_equations(linearised(edges, state))
    change = _solved(normal, wanted)[..., 0]
    light, ink = np.maximum(1.0 + change[:, LIGHT], 1.0), change[:, INK]
    contrast = np.copysign(np.maximum(np.abs(light - ink), 1.0), light - ink)
    state[:, :INK] += limited(change[:, :INK] / contrast[:, None])
    state[:, INK], state[:, LIGHT] = ink / light, light
    state[:, LIGHT + 1 :] = change[:, LIGHT + 1 :]
    return state


def settled(
    edges: Edges,
    state: FloatArray,
    by_shift: FloatArray,
    noise: float,
    prior: Prior | None = None,
) -> Progress:
    """Take steps until the discs stay where they are, but few.

    Args:
        edges: Pixels around the edges.
        state: (n, p) where to start; terms of the light that the prior does not know are left out.
        by_shift: (n, 2, 2) derivatives of the images of the centres by the shifts.
        noise: Standard deviation of a grey level, which matters at the limits of the sensor.
        prior: What is known beforehand, None in a first round, which another one follows.
    """
    enough = _STILL_AT_FIRST
    if prior is not None:
        state, enough = with_terms(state, GROWTH + prior.mean.shape[1]), _STILL
    for _ in range(_MOST_STEPS_CLIPPED if edges.clipped else _MOST_STEPS):
        last = _stepped(edges, state, noise, prior)
        change = last.state - state
        state = last.state
        still = np.max(np.abs(by_shift @ change[:, SHIFT, None])) < enough * last.blur
        if still and (not edges.clipped or _light_rests(change, last)):
            break
    return last


def with_terms(state: FloatArray, count: int) -> FloatArray:
    """Return the state with so many terms of the light after its level."""
    out = np.zeros((len(state), count))
    kept = min(out.shape[1], state.shape[1])
    out[:, :kept] = state[:, :kept]
    return out


def _light_rests(change: FloatArray, last: Progress) -> bool:
    return float(np.max(np.abs(change[:, LIGHT]))) < _LIGHT_STILL * math.sqrt(last.variance)


def _stepped(edges: Edges, state: FloatArray, noise: float, prior: Prior | None) -> Progress:
    rows = linearised(edges, state)
    count = edges.count - clip_rows(edges, rows, noise)
    normal, wanted, squares = normal_equations(rows)
    if edges.clipped:
        normal, wanted = held_within(normal, wanted, state, (LIGHT, INK), noise)
    solved = _solved(normal, wanted, state, prior)
    step = limited(solved[..., 0])
    squares = foretold(squares, normal, wanted, step)
    return Progress(advanced(state, step), solved[..., 1:], squares, count)


def advanced(state: FloatArray, step: FloatArray) -> FloatArray:
    """Return the (n, p) state after a step, the blur within its limits."""
    after = state + step
    after[:, BLUR] = np.minimum(np.maximum(after[:, BLUR], _BLUR_LIMITS[0]), _BLUR_LIMITS[1])
    return np.asarray(after)


def foretold(
    squares: FloatArray, normal: FloatArray, wanted: FloatArray, step: FloatArray
) -> FloatArray:
    """Return the (n,) sums of squares after (n, p) steps, as the normal equations have them."""
    slope = (normal @ step[..., None])[..., 0] - 2.0 * wanted
    change = np.einsum("np,np->n", step, slope)
    return np.asarray(np.maximum(squares + change, 0.0))


def limited(step: FloatArray) -> FloatArray:
    """Return a (n, p) step that is not larger than one may believe."""
    largest = _LARGEST_STEP[: step.shape[1]]
    return np.asarray(np.minimum(np.maximum(step, -largest), largest))


def normal_equations(rows: SingleArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the (n, p, p) and (n, p) normal equations of (p + 1, n, m) rows, and (n,) squares."""
    # without the last row on the left: a matrix times its own transpose is slow in small ones
    products = np.matmul(rows[:-1].swapaxes(0, 1), rows.transpose(1, 2, 0)).astype(float)
    squares = np.einsum("nm,nm->n", rows[-1], rows[-1]).astype(float)
    return products[..., :-1], products[..., -1], squares


def clip_rows(edges: Edges, rows: SingleArray, noise: float) -> FloatArray:
    """Clip the light behind (p + 1, n, m) rows, in place; return the (n,) pixels that are lost."""
    if not edges.clipped:
        return np.zeros(rows.shape[1])
    light = (edges.grey - rows[-1]).ravel()
    near = np.flatnonzero(near_limits(light, noise) & (edges.weight.ravel() > 0.0))
    seen = clipped(light[near], noise)
    flat = rows.reshape(len(rows), -1)
    flat[:-1, near] *= seen.slope
    flat[-1, near] = edges.grey.ravel()[near] - seen.mean
    return np.asarray(np.bincount(near // rows.shape[2], 1.0 - seen.variance, rows.shape[1]))


def _solved(
    normal: FloatArray,
    wanted: FloatArray,
    state: FloatArray | None = None,
    prior: Prior | None = None,
) -> FloatArray:
    """Return (n, p, 4): the step, and the covariances with the parameters that are asked for."""
    right = np.empty((*wanted.shape, 1 + len(KEPT)))
    right[..., 1:] = kept_columns(wanted.shape[1])
    damped, right[..., 0] = with_prior(normal, wanted, state, prior)
    return np.asarray(np.linalg.solve(damped, right))


@lru_cache
def kept_columns(count: int) -> FloatArray:
    """Return the (p, 3) unit vectors of the parameters whose covariances are kept, of p."""
    return np.eye(count)[:, KEPT]


def with_prior(
    normal: FloatArray,
    wanted: FloatArray,
    state: FloatArray | None,
    prior: Prior | None,
) -> tuple[FloatArray, FloatArray]:
    """Return (n, p, p) and (n, p) normal equations, a little damped, with what else is known."""
    # nothing at all is seen of a disc outside of the image
    damped, right = normal.copy(), wanted.copy()
    diagonal = damped.reshape(len(damped), -1)[:, :: damped.shape[1] + 1]
    diagonal *= 1.0 + _DAMPING
    diagonal += 1e-15
    if prior is not None and state is not None:
        diagonal[:, GROWTH:] += prior.precision
        right[:, GROWTH:] += (prior.mean - state[:, GROWTH:]) * prior.precision
    return damped, right


def linearised(edges: Edges, state: FloatArray, out: SingleArray | None = None) -> SingleArray:
    """Return derivatives of the grey levels by the parameters, and the residuals.

    Args:
        edges: Pixels around the edges.
        state: (n, p) parameters.
        out: (p + 1, n, m) takes them, if given.
    """
    single = state.astype(np.float32)
    ink = single[:, INK, None]
    terms = edges.terms[: state.shape[1] - LIGHT]
    shape = (state.shape[1] + 1, *edges.grey.shape)
    rows = np.empty(shape, dtype=np.float32) if out is None else out
    # in place from here on, as time goes into memory
    light = combined(single[:, LIGHT:], terms)
    light *= edges.weight
    covered = edges.covered(single[:, :INK], light * (ink - 1.0), rows[:INK])
    np.multiply(light, covered, out=rows[INK])
    covered *= ink - 1.0
    covered += 1.0
    covered *= edges.weight
    np.multiply(terms, covered, out=rows[LIGHT:-1])
    light *= covered
    np.subtract(edges.grey, light, out=rows[-1])
    return rows
