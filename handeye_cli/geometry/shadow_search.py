"""The edge of a shadow that the levels of the light show, all over a plate."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution
from handeye_cli.geometry.descent import descended
from handeye_cli.geometry.light_slopes import Light, typical
from handeye_cli.geometry.shadow_edge import PARAMETERS, SIMPLE, ShadowEdge

FloatArray = NDArray[np.float64]

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
_SHALLOWEST = 0.03
"""Least share of the light that a shadow takes."""
_UNSEEN = 1e-6
"""Sum of squares, over the variances of levels, of what planes leave of a step by one grey level,
below which none is seen."""
_UNEVEN = 0.01
"""By how much levels differ from a plane's beside the shadow, in levels."""
_FEWEST = 12
"""Levels that an edge with four parameters and a plane leave some of."""
_STEPS, _ENOUGH = 12, 1e-2
_TINY = 1e-12


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
    beside = np.eye(len(level)) - weighted.T @ np.linalg.solve(_products(weighted), weighted)
    left = beside @ level
    if left @ left < len(level):
        return None
    chosen = _best_of(root * steps.taken, beside, left, -_SHALLOWEST * typical(levels.level))
    if chosen is None:
        return None
    direction, offset, width = steps.parameters[:, chosen]
    basis = np.concatenate([weighted, root * steps.taken[chosen, None]])
    factors: FloatArray = np.asarray(np.linalg.solve(_products(basis), basis @ level), dtype=float)
    depth = -factors[-1] / factors[0]
    parameters = np.zeros(PARAMETERS)
    parameters[:SIMPLE] = direction, offset * pitches, math.log(width * pitches), depth
    edge = replace(levels.edge, parameters=parameters)
    return replace(levels, plane=factors[:-1], edge=edge.moved(np.zeros(PARAMETERS)))


def _products(rows: FloatArray) -> FloatArray:
    """Return the (k, k) products of (k, n) rows, a little apart from those of rows in one plane."""
    products = rows @ rows.T
    products.ravel()[:: len(rows) + 1] *= 1.0 + _TINY
    products.ravel()[:: len(rows) + 1] += _TINY
    return np.asarray(products)


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
    darker = (along < highest * square) & (square > _UNSEEN)
    explained = np.where(darker, along * along / np.maximum(square, _UNSEEN), -1.0)
    return int(np.argmax(explained)) if darker.any() else None
