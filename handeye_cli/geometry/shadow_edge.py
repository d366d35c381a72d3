"""The edge of a shadow across a plate: a straight, soft step of the light.

Across the edge the light falls as a normal distribution function. Its fourth moment is free, as
penumbras differ (the first term of a Gram-Charlier series).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution
from handeye_cli.geometry.descent import descended
from handeye_cli.geometry.light_slopes import Light, typical

FloatArray = NDArray[np.float64]

_ORDERS = (3, 5)
"""Orders of the Hermite polynomials that bend the profile: one less than those of moments."""
_SIMPLE = 4
PARAMETERS = _SIMPLE + len(_ORDERS)
"""Of an edge: direction, offset and logarithm of the width in pitches, depth; then moments."""
_LEAST = np.array([-np.inf, -np.inf, -3.0, 0.01, *[-0.1] * len(_ORDERS)])
_MOST = np.array([np.inf, np.inf, 1.5, 0.95, *[0.1] * len(_ORDERS)])
"""Limits of the parameters: never full darkness, and always an edge."""
_DARKEST = np.float32(0.02)
"""Least share of the light that is left anywhere."""
_LARGEST_STEP = np.array([0.2, 0.3, 0.4, 0.1, *[0.05] * len(_ORDERS)])
_EVEN = np.zeros(len(_ORDERS))
_DIRECTIONS = 2.0 * np.pi * np.arange(12) / 12
_OFFSETS = np.linspace(-0.6, 0.6, 7)
_WIDTHS = np.array([0.2, 0.6, 1.8])
"""Edges to begin with: radians, shares of the plate's half extent, pitches."""
_SHALLOWEST = 0.03
"""Least share of the light that a shadow takes."""
_UNEVEN = 0.01
"""By how much levels differ from a plane's beside the shadow, in levels."""
_FEWEST = 12
"""Levels that an edge with four parameters and a plane leave some of."""
_STEPS, _ENOUGH = 12, 1e-3


@dataclass(frozen=True)
class ShadowEdge:
    """A shadow's edge in an image.

    Attributes:
        middle: (2,) pixels, and the pitch, from which and in which lengths are measured.
        pitch: Pixels.
        parameters: (5,) direction to where the shadow lies, radians from u; offset and logarithm
            of the standard deviation of the edge, in pitches; share of the light that is taken;
            fourth moment, over 24 and in excess of a Gaussian's.
    """

    middle: FloatArray
    pitch: float
    parameters: FloatArray

    def moved(self, step: FloatArray) -> ShadowEdge:
        """Return the edge with parameters that are larger by a (5,) step, within limits."""
        step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        parameters = np.clip(self.parameters + step, _LEAST, _MOST)
        return ShadowEdge(self.middle, self.pitch, parameters)

    def left(self, u: FloatArray | SingleArray, v: FloatArray | SingleArray) -> SingleArray:
        """Return the (...) shares of the light that are left at (...) pixels u, v."""
        return self.with_slopes(u, v)[0]

    def with_slopes(
        self, u: FloatArray | SingleArray, v: FloatArray | SingleArray
    ) -> tuple[SingleArray, SingleArray]:
        """Return the (...) shares that are left and their (5, ...) derivatives."""
        direction, offset, width, depth, *moments = (np.float32(each) for each in self.parameters)
        x = ((u - self.middle[0]) / self.pitch).astype(np.float32)
        y = ((v - self.middle[1]) / self.pitch).astype(np.float32)
        cosine, sine, scale = np.cos(direction), np.sin(direction), np.exp(-width)
        z = (x * cosine + y * sine - offset) * scale
        taken, density = normal_distribution(z)
        # the derivative of He_n times the density is -He_(n+1) times the density
        hermite = [density, z * density]
        while len(hermite) <= _ORDERS[-1] + 1:
            hermite.append(z * hermite[-1] - (len(hermite) - 1) * hermite[-2])
        steep = density.copy()
        for order, moment in zip(_ORDERS, moments, strict=True):
            taken -= moment * hermite[order]
            steep += moment * hermite[order + 1]
        steep *= -depth
        turning = steep * scale * (y * cosine - x * sine)
        slopes = [turning, -steep * scale, -steep * z, -taken]
        slopes += [depth * hermite[order] for order in _ORDERS]
        return np.maximum(1 - depth * taken, _DARKEST), np.stack(slopes)


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
        left, by_edge = self.edge.with_slopes(*self.places)
        even = self.plane @ self.terms
        # moments are left to the pixels
        slopes = np.concatenate([self.terms * left, by_edge[:_SIMPLE] * even])
        return self.level - even * left, slopes

    @cached_property
    def cost(self) -> float:
        """Weighted sum of squared residuals."""
        return float(np.sum(self.weight * self._modelled[0] ** 2))

    def stepped(self, damping: float) -> _LevelsInShadow:
        """Return the levels after a damped step."""
        residuals, slopes = self._modelled
        normal = (slopes * self.weight) @ slopes.T
        normal += damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(len(normal))
        step = np.linalg.solve(normal, slopes @ (self.weight * residuals))
        edge = self.edge.moved(np.append(step[len(self.plane) :], _EVEN))
        return replace(self, plane=self.plane + step[: len(self.plane)], edge=edge)


def edge_in(light: Light, pitch: float) -> ShadowEdge | None:
    """Return the edge of the shadow that explains levels best, None where a plane does as well.

    A few levels show no edge.

    Args:
        light: Levels all over a plate.
        pitch: Distance between discs, pixels.
    """
    if len(light.level) < _FEWEST:
        return None
    middle = light.places.mean(axis=0)
    extent = float(np.max(np.abs(light.places - middle)))
    x, y = (light.places - middle).T / extent
    weight = 1.0 / (light.variance + (_UNEVEN * typical(light.level)) ** 2)
    terms = np.stack([np.ones_like(x), x, y])
    if _missed_by_plane(light.level, weight, terms) < len(x):
        return None
    direction, offset, width = (
        each.ravel() for each in np.meshgrid(_DIRECTIONS, _OFFSETS, _WIDTHS * pitch / extent)
    )
    across = np.outer(np.cos(direction), x) + np.outer(np.sin(direction), y)
    across = (across - offset[:, None]) / width[:, None]
    taken, _ = normal_distribution(across.astype(np.float32))
    chosen, factors = _best_of(light.level, weight, terms, taken.astype(float))
    parameters = [
        direction[chosen],
        offset[chosen] * extent / pitch,
        math.log(width[chosen] * extent / pitch),
        -factors[-1] / factors[0],
        *_EVEN,
    ]
    edge = ShadowEdge(middle, pitch, np.array(parameters)).moved(np.zeros(PARAMETERS))
    start = _LevelsInShadow(light.level, weight, terms, light.places.T, factors[:-1], edge)
    return descended(start, most=_STEPS, enough=_ENOUGH).edge


def _missed_by_plane(level: FloatArray, weight: FloatArray, terms: FloatArray) -> float:
    """Return the weighted sum of squares that (3, n) terms of a plane leave of (n,) levels."""
    factors = np.linalg.lstsq((terms * np.sqrt(weight)).T, level * np.sqrt(weight), rcond=None)[0]
    return float(np.sum(weight * (level - factors @ terms) ** 2))


def _best_of(
    level: FloatArray, weight: FloatArray, terms: FloatArray, taken: FloatArray
) -> tuple[int, FloatArray]:
    """Return which of c steps explains levels best, and the (4,) factors of plane and step.

    Args:
        level: (n,) levels.
        weight: (n,) of the levels.
        terms: (3, n) of the plane.
        taken: (c, n) steps.
    """
    plane = np.broadcast_to(terms, (len(taken), *terms.shape))
    basis = np.concatenate([plane, taken[:, None]], axis=1)
    weighted = basis * weight
    normal = weighted @ np.swapaxes(basis, 1, 2)
    normal += 1e-9 * weight.sum() * np.eye(len(terms) + 1)
    right = weighted @ level
    factors = np.linalg.solve(normal, right[..., None])[..., 0]
    explained = np.sum(factors * right, axis=1)
    darker = factors[:, -1] < -_SHALLOWEST * factors[:, 0]
    chosen = int(np.argmax(np.where(darker, explained, -np.inf)))
    return chosen, factors[chosen]
