"""The edge of a shadow across a plate: a straight, soft step of the light.

Across the edge the light falls as a normal distribution function. Its fourth and sixth moments are
free within limits, as penumbras differ (two terms of a Gram-Charlier series).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution
from handeye_cli.geometry.descent import descended
from handeye_cli.geometry.light_slopes import Light, typical

FloatArray = NDArray[np.float64]
Array = TypeVar("Array", FloatArray, SingleArray)

_ORDERS = (3, 5)
"""Orders of the Hermite polynomials that bend the profile: one less than those of moments."""
_SIMPLE = 4
PARAMETERS = _SIMPLE + len(_ORDERS)
"""Of an edge: direction, offset and logarithm of the width in pitches, depth; then moments."""
SPREADS = np.array([np.inf, np.inf, np.inf, 0.03, 0.03, 0.01])
SPREADS_AT_FIRST = SPREADS[:_SIMPLE]
"""Standard deviations of the parameters about those that levels show, as far as these are known. At
first, as the edge is not yet where it is, its moments are not asked for."""
_LEAST = np.array([-np.inf, -np.inf, -5.0, 0.01, *[-0.1] * len(_ORDERS)])
_MOST = np.array([np.inf, np.inf, 1.5, 0.95, *[0.1] * len(_ORDERS)])
"""Limits of the parameters: never full darkness, and always an edge."""
_DARKEST = 0.02
"""Least share of the light that is left anywhere."""
_LARGEST_STEP = np.array([0.2, 0.3, 0.4, 0.1, *[0.05] * len(_ORDERS)])
_EVEN = np.zeros(len(_ORDERS))
_ROUGHLY = np.reshape(
    np.meshgrid(2.0 * np.pi * np.arange(12) / 12, np.linspace(-0.6, 0.6, 7), [0.2, 0.6, 1.8]),
    (3, -1),
)
_FINELY = np.reshape(
    np.meshgrid(2.0 * np.pi * np.arange(36) / 36, np.linspace(-0.9, 0.9, 25), [0.2]), (3, -1)
)
"""Edges to begin with: radians, shares of the plate's half extent, pitches. A sharp edge is seen by
few levels, and one that is half a pitch away explains less of them than a soft one elsewhere."""
_EXPLAINED = 3.0
"""Mean square residual of levels, over their variance, above which other edges are tried."""
_BEGINNING = 0.15
"""Least width in pitches to begin with: discs that a sharper edge does not yet cross do not call
it."""
_REACH = 3.0
"""How many pitches an edge is long to both sides."""
_STILL = 0.15
"""By how much of its width an edge may move, and as much besides, for the next step to be small.
More would do on paper that is not white, where steps come to rest slowly."""
_SOFTEST = 1.05
"""Width of an edge, in pitches, from which on the light is smooth within a disc as it is."""
_SHALLOWEST = 0.03
"""Least share of the light that a shadow takes."""
_UNEVEN = 0.01
"""By how much levels differ from a plane's beside the shadow, in levels."""
_FEWEST = 12
"""Levels that an edge with four parameters and a plane leave some of."""
_STEPS, _ENOUGH = 12, 1e-2
_TINY, _ROOT = 1e-12, math.sqrt(2.0 * math.pi)


@dataclass(frozen=True)
class ShadowEdge:
    """A shadow's edge in an image.

    Attributes:
        middle: (2,) pixels, and the pitch, from which and in which lengths are measured.
        pitch: Pixels.
        parameters: (6,) direction to where the shadow lies, radians from u; offset and logarithm
            of the standard deviation of the edge, in pitches; share of the light that is taken;
            coefficients of the Hermite polynomials of `_ORDERS`.
    """

    middle: FloatArray
    pitch: float
    parameters: FloatArray

    def moved(self, step: FloatArray) -> ShadowEdge:
        """Return the edge with (k,) first parameters larger by a step, within limits."""
        largest = _LARGEST_STEP[: len(step)]
        parameters = self.parameters.copy()
        parameters[: len(step)] += np.minimum(np.maximum(step, -largest), largest)
        parameters = np.minimum(np.maximum(parameters, _LEAST), _MOST)
        return ShadowEdge(self.middle, self.pitch, parameters)

    def rests_since(self, before: ShadowEdge) -> bool:
        """Return whether next to nothing is left to another step after the one from there."""
        width = math.exp(self.parameters[2])
        noticed = [_REACH / width, 1.0 / width, *[1.0] * (PARAMETERS - 2)]
        return bool(np.max(np.abs(self.parameters - before.parameters) * noticed) < _STILL)

    @property
    def softened(self) -> ShadowEdge:
        """The edge with a width from which steps to sharper ones lead."""
        parameters = self.parameters.copy()
        parameters[2] = max(parameters[2], math.log(_BEGINNING))
        return replace(self, parameters=parameters)

    @property
    def sharp(self) -> bool:
        """Whether the light changes much within a disc."""
        return bool(math.exp(self.parameters[2]) <= _SOFTEST)

    def between(self, places: FloatArray) -> bool:
        """Return whether the middle of the edge is between (n, 2) places."""
        direction, offset = self.parameters[:2]
        across = (places - self.middle) @ np.array([math.cos(direction), math.sin(direction)])
        return bool(across.min() < offset * self.pitch < across.max())

    def left(self, u: Array, v: Array) -> SingleArray:
        """Return the (...) shares of the light that are left at (...) pixels u, v."""
        across = self._places(u, v)[0].astype(np.float32, copy=False)
        taken, density = normal_distribution(across)
        if self.parameters[_SIMPLE:].any():
            self._bend(across, taken, density, None)
        return self._of_taken(taken)

    def with_slopes(self, u: Array, v: Array, slopes: SingleArray) -> SingleArray:
        """Return the (...) shares that are left, and set their slopes.

        Args:
            u: (...) pixels.
            v: (...) pixels.
            slopes: (k, ...) takes those by the k first parameters, with or without the moments.
        """
        across, along = (each.astype(np.float32, copy=False) for each in self._places(u, v))
        taken, steep = normal_distribution(across)
        of_moments = slopes[_SIMPLE:]
        if len(of_moments) > 0 or self.parameters[_SIMPLE:].any():
            self._bend(across, taken, steep, of_moments if len(of_moments) > 0 else None)
        self._simple_slopes(across, along, taken, steep, slopes)
        return self._of_taken(taken)

    def _bend(
        self,
        across: SingleArray,
        taken: SingleArray,
        steep: SingleArray,
        slopes: SingleArray | None,
    ) -> None:
        """Add what the moments do to (...) shares that are taken and how steeply these fall.

        Args:
            across: (...) places across the edge.
            taken: (...) shares without moments, in place.
            steep: (...) their slopes, in place.
            slopes: (2, ...) takes the slopes of what is left by the moments, if asked for.
        """
        hermite = _hermite(across, steep.copy())
        *_, depth, third, fifth = self.parameters.tolist()
        for k, (order, moment) in enumerate(zip(_ORDERS, (third, fifth), strict=True)):
            taken -= moment * hermite[order]
            steep += moment * hermite[order + 1]
            if slopes is not None:
                np.multiply(hermite[order], depth, out=slopes[k])

    def with_simple_slopes(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return shares and (4, ...) slopes by all but the moments, which are taken to be 0.

        For a few places, where double precision with fewer calls is the quicker one.
        """
        slopes = np.empty((_SIMPLE, *u.shape))
        across, along = self._places(u, v)
        taken, steep = ndtr(across), np.exp(-0.5 * across * across) / _ROOT
        self._simple_slopes(across, along, taken, steep, slopes)
        return self._of_taken(taken), slopes

    def _places(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Return (...) places across the edge in its widths, and along it in pitches."""
        direction, offset, width = self.parameters[:3].tolist()
        cosine, sine = math.cos(direction) / self.pitch, math.sin(direction) / self.pitch
        scale, (x, y) = math.exp(-width), self.middle.tolist()
        across = u * (cosine * scale) + v * (sine * scale)
        across -= (x * cosine + y * sine + offset) * scale
        along = u * sine - v * cosine
        along -= x * sine - y * cosine
        return across, along

    def _simple_slopes(
        self, across: Array, along: Array, taken: Array, steep: Array, out: Array
    ) -> None:
        """Set the (4, ...) slopes of what is left; what is taken falls as steeply as given."""
        width, depth = self.parameters[2:4].tolist()
        steep *= depth
        np.multiply(steep, math.exp(-width), out=out[1])
        np.multiply(out[1], along, out=out[0])
        np.multiply(steep, across, out=out[2])
        np.negative(taken, out=out[3])

    def _of_taken(self, taken: Array) -> Array:
        """Return the shares that are left where (...) shares of the depth are taken, in place."""
        taken *= -float(self.parameters[3])
        taken += 1.0
        return np.maximum(taken, _DARKEST, out=taken)


def _hermite(x: SingleArray, density: SingleArray) -> list[SingleArray]:
    """Return Hermite's polynomials of (...) numbers up to those needed, times their density.

    The derivative of He_n times the density is -He_(n+1) times the density.
    """
    out = [density, x * density]
    while len(out) <= _ORDERS[-1] + 1:
        following = x * out[-1]
        following -= np.float32(len(out) - 1) * out[-2]
        out.append(following)
    return out


@dataclass(frozen=True)
class _LevelsInShadow:
    """Levels of the light as a plane under a shadow's edge explains them; `Descending`.

    Attributes:
        level: (n,) levels.
        weight: (n,) one over their variances.
        terms: (3, n) of the plane.
        places: (2, n) pixels u, v.
        plane: (3,) factors of the terms.
        edge: The shadow's edge.
    """

    level: FloatArray
    weight: FloatArray
    terms: FloatArray
    places: FloatArray
    plane: FloatArray
    edge: ShadowEdge

    @cached_property
    def _modelled(self) -> tuple[FloatArray, FloatArray]:
        """(n,) residuals of the levels, and (3 + 4, n) derivatives of what is modelled."""
        # moments are left to the pixels
        left, by_edge = self.edge.with_simple_slopes(*self.places)
        even = self.plane @ self.terms
        slopes = np.concatenate([self.terms * left, by_edge * even])
        return self.level - even * left, slopes

    @cached_property
    def cost(self) -> float:
        """Weighted sum of squared residuals."""
        return float(np.sum(self.weight * self._modelled[0] ** 2))

    def stepped(self, damping: float) -> _LevelsInShadow:
        """Return the levels after a damped step."""
        residuals, slopes = self._modelled
        weighted = slopes * self.weight
        normal = weighted @ slopes.T
        diagonal = normal.ravel()[:: len(normal) + 1]
        diagonal *= 1.0 + damping
        diagonal += _TINY
        step = np.linalg.solve(normal, weighted @ residuals)
        edge = self.edge.moved(np.asarray(step[len(self.plane) :], dtype=np.float64))
        plane = self.plane + step[: len(self.plane)]
        return _LevelsInShadow(self.level, self.weight, self.terms, self.places, plane, edge)


def edge_in(light: Light, pitch: float) -> ShadowEdge | None:
    """Return the edge of the shadow that explains levels best, None where a plane does as well.

    A few levels show no edge, nor is one beside the plate the edge of a shadow on it.

    Args:
        light: Levels all over a plate.
        pitch: Distance between discs, pixels.
    """
    if len(light.level) < _FEWEST:
        return None
    middle = light.places.mean(axis=0)
    extent = float(np.max(np.abs(light.places - middle)))
    places = (light.places - middle).T / extent
    weight = 1.0 / (light.variance + (_UNEVEN * typical(light.level)) ** 2)
    terms = np.concatenate([np.ones_like(places[:1]), places])
    even = ShadowEdge(middle, pitch, np.zeros(PARAMETERS))
    levels = _LevelsInShadow(light.level, weight, terms, light.places.T, np.zeros(3), even)
    best: _LevelsInShadow | None = None
    for tried in (_ROUGHLY, _FINELY):
        start = _begun(levels, _steps(places, pitch / extent, tried), extent / pitch)
        if start is None:
            break
        found = descended(start, most=_STEPS, enough=_ENOUGH)
        best = found if best is None or found.cost < best.cost else best
        if best.cost < _EXPLAINED * len(light.level):
            break
    return best.edge if best is not None and best.edge.between(light.places) else None


def _begun(levels: _LevelsInShadow, steps: _Steps, pitches: float) -> _LevelsInShadow | None:
    """Return levels with the step that explains them best, None where a plane does as well.

    Args:
        levels: The levels.
        steps: Steps of the light.
        pitches: In the plate's half extent.
    """
    root = np.sqrt(levels.weight)
    weighted, level = levels.terms * root, root * levels.level
    # what planes leave of things is their part beside them
    beside = np.eye(len(level)) - weighted.T @ np.linalg.solve(weighted @ weighted.T, weighted)
    left = beside @ level
    if left @ left < len(level):
        return None
    chosen = _best_of(root * steps.taken, beside, left, -_SHALLOWEST * typical(levels.level))
    if chosen is None:
        return None
    direction, offset, width = steps.parameters[:, chosen]
    basis = np.concatenate([weighted, root * steps.taken[chosen, None]])
    factors = np.linalg.solve(basis @ basis.T, basis @ level)
    parameters = [direction, offset * pitches, math.log(width * pitches), -factors[-1] / factors[0]]
    edge = replace(levels.edge, parameters=np.array([*parameters, *_EVEN]))
    return replace(levels, plane=factors[:-1], edge=edge.moved(np.zeros(PARAMETERS)))


class _Steps(NamedTuple):
    """The c steps of the light to begin with.

    Attributes:
        parameters: (3, c) directions, offsets and widths.
        taken: (c, n) shares of the light that they take, if all.
    """

    parameters: FloatArray
    taken: SingleArray


def _steps(places: FloatArray, pitch: float, tried: FloatArray) -> _Steps:
    """Return steps of the light at (2, n) places in units of the plate's half extent.

    Args:
        places: Where.
        pitch: In these units.
        tried: (3, c) directions, offsets in these units, and widths in pitches.
    """
    direction, offset, width = tried
    width = width * pitch
    across = np.array([np.cos(direction) / width, np.sin(direction) / width]).T @ places
    across -= (offset / width)[:, None]
    taken, _ = normal_distribution(across.astype(np.float32))
    return _Steps(np.array([direction, offset, width]), taken)


def _best_of(steps: FloatArray, beside: FloatArray, left: FloatArray, highest: float) -> int | None:
    """Return which step explains best what a plane leaves of levels.

    Args:
        steps: (c, n) steps, weighted as the levels are.
        beside: (n, n) projection to what planes leave.
        left: (n,) levels after it.
        highest: Factor of a step that is not above this makes the light darker.

    Returns:
        Number of the step, None if none makes the light darker.
    """
    along, square = steps @ left, np.einsum("cn,cn->c", steps @ beside, steps)
    darker = along < highest * square
    explained = np.where(darker, along * along / np.maximum(square, _TINY), -1.0)
    return int(np.argmax(explained)) if darker.any() else None
