"""The edge of a shadow across a plate: a straight, soft step of the light.

Across the edge the light falls as a normal distribution function. Its fourth and sixth moments are
free within limits, as penumbras differ (two terms of a Gram-Charlier series).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution

FloatArray = NDArray[np.float64]
Array = TypeVar("Array", FloatArray, SingleArray)

_ORDERS = (3, 5)
"""Orders of the Hermite polynomials that bend the profile: one less than those of moments."""
SIMPLE = 4
PARAMETERS = SIMPLE + len(_ORDERS)
"""Of an edge: direction, offset and logarithm of the width in pitches, depth; then moments."""
SPREADS = np.array([np.inf, np.inf, np.inf, 0.03, 0.03, 0.01])
SPREADS_AT_FIRST = SPREADS[:SIMPLE]
"""Standard deviations of the parameters about those that levels show, as far as these are known. At
first, as the edge is not yet where it is, its moments are not asked for."""
_LEAST = np.array([-np.inf, -np.inf, -5.0, 0.01, *[-0.1] * len(_ORDERS)])
_MOST = np.array([np.inf, np.inf, 1.5, 0.95, *[0.1] * len(_ORDERS)])
"""Limits of the parameters: never full darkness, and always an edge."""
_DARKEST = 0.02
"""Least share of the light that is left anywhere."""
_LARGEST_STEP = np.array([0.2, 0.3, 0.4, 0.1, *[0.05] * len(_ORDERS)])
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
_ROOT = math.sqrt(2.0 * math.pi)


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
        noticed = [_REACH / self.width, 1.0 / self.width, *[1.0] * (PARAMETERS - 2)]
        return bool(np.max(np.abs(self.parameters - before.parameters) * noticed) < _STILL)

    @property
    def softened(self) -> ShadowEdge:
        """The edge with a width from which steps to sharper ones lead."""
        parameters = self.parameters.copy()
        parameters[2] = max(parameters[2], math.log(_BEGINNING))
        return replace(self, parameters=parameters)

    @property
    def width(self) -> float:
        """Standard deviation of the edge, pitches."""
        return math.exp(self.parameters[2])

    @property
    def sharp(self) -> bool:
        """Whether the light changes much within a disc."""
        return self.width <= _SOFTEST

    def between(self, places: FloatArray) -> bool:
        """Return whether the middle of the edge is between (n, 2) places."""
        direction, offset = self.parameters[:2]
        across = (places - self.middle) @ np.array([math.cos(direction), math.sin(direction)])
        return bool(across.min() < offset * self.pitch < across.max())

    def left(self, u: Array, v: Array) -> SingleArray:
        """Return the (...) shares of the light that are left at (...) pixels u, v."""
        across = self._places(u, v)[0].astype(np.float32, copy=False)
        taken, density = normal_distribution(across)
        if self.parameters[SIMPLE:].any():
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
        of_moments = slopes[SIMPLE:]
        if len(of_moments) > 0 or self.parameters[SIMPLE:].any():
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
        slopes = np.empty((SIMPLE, *u.shape))
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
