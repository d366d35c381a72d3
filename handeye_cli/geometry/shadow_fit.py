"""Discs that the edge of a shadow crosses, and that edge, fitted to the discs' pixels together.

Within a disc the edge of a shadow may be sharper than the light's plane or quadratic can follow.
But it is one edge for all discs: few parameters, which their pixels know well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from handeye_cli.geometry.descent import descended
from handeye_cli.geometry.disc_conics import Conics
from handeye_cli.geometry.disc_edges import Edges
from handeye_cli.geometry.disc_pixels import FloatArray, SingleArray
from handeye_cli.geometry.disc_priors import Surface
from handeye_cli.geometry.disc_steps import (
    COURSE,
    GROWTH,
    INK,
    LIGHT,
    Prior,
    Progress,
    limited,
    linearised,
    settled,
    with_terms,
)
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.shadow_edge import PARAMETERS, ShadowEdge, edge_in

_PIXELS = 200
"""Of a disc, which are enough for what all discs share."""
_STEPS, _ENOUGH = 8, 1e-3
_TINY = 1e-9
_SLACK = 0.003
"""What a shadow's edge may miss of the change of the light over a pitch, in levels."""

PriorOf = Callable[[Surface, Progress], Prior]


@dataclass(frozen=True)
class _DiscsInShadow:
    """Discs under the edge of a shadow; `Descending`.

    Attributes:
        edges: Pixels of the discs, in full light.
        places: (2, n, m) where they are in the image.
        prior: What is known of the discs.
        state: (n, p) their parameters, in full light.
        shadow: The shadow's edge.
    """

    edges: Edges
    places: SingleArray
    prior: Prior
    state: FloatArray
    shadow: ShadowEdge

    @cached_property
    def _products(self) -> FloatArray:
        """(n, p + 6, p + 6) products of derivatives by discs and shadow, and of residuals."""
        left, slopes = self.shadow.with_slopes(*self.places)
        rows = linearised(replace(self.edges, terms=self.edges.terms * left), self.state)
        seen = (self.edges.grey - rows[-1]) / left
        rows = np.concatenate([rows[:-1], slopes * seen, rows[-1:]])
        return np.asarray(np.matmul(rows.swapaxes(0, 1), rows.transpose(1, 2, 0)), dtype=float)

    @cached_property
    def cost(self) -> float:
        """Sum of squared residuals."""
        return float(np.sum(self._products[:, -1, -1]))

    def stepped(self, damping: float) -> _DiscsInShadow:
        """Return the discs and the shadow after a damped step.

        The normal equations are those of the discs, one by one, bordered by the shadow's.
        """
        count = self.state.shape[1]
        products = self._products.copy()
        diagonal = np.einsum("nii->ni", products)[:, :-1]
        diagonal *= 1.0 + damping
        diagonal += _TINY
        diagonal[:, GROWTH:count] += self.prior.precision
        off = (self.prior.mean - self.state[:, GROWTH:]) * self.prior.precision
        products[:, GROWTH:count, -1] += off
        discs, both = products[:, :count, :count], products[:, :count, count:]
        solved = np.linalg.solve(discs, both)
        border = products[:, count:-1, count:] - np.swapaxes(both[..., :-1], 1, 2) @ solved
        border = border.sum(axis=0)
        step = np.linalg.solve(border[:, :PARAMETERS], border[:, PARAMETERS])
        change = solved[..., -1] - solved[..., :-1] @ step
        return replace(self, state=self.state + limited(change), shadow=self.shadow.moved(step))


def settled_in_shadow(
    edges: Edges, conics: Conics, last: Progress, surface: Surface, prior_of: PriorOf
) -> Progress:
    """Fit discs and the edge of a shadow, if there is one.

    Args:
        edges: Pixels of the discs.
        conics: The outlines of the discs.
        last: What is known without the edge.
        surface: Where more is known of the light.
        prior_of: What that says about the discs.

    Returns:
        What is known with the edge of the shadow, the light in the middle of the discs as it is
        seen there; what was known before if that explains the pixels as well.
    """
    apart = np.linalg.norm(surface.places[:, None] - surface.places, axis=-1)
    pitch = typical(np.partition(apart, 1, axis=1)[:, 1])
    light = surface.light(last, last.sound)
    shadow = edge_in(light, pitch)
    if shadow is None:
        return last
    slack = (_SLACK * typical(light.level), pitch)
    begun = _without(last, shadow, surface)
    prior = _loosened(prior_of(surface.lit(shadow), begun), begun.noise, slack)
    state = with_terms(begun.state[:, : LIGHT + 1], GROWTH + prior.mean.shape[1])
    state[:, COURSE] = prior.mean[:, COURSE.start - GROWTH :]
    origin = conics.origin.T[..., None].astype(np.float32)
    some = edges.some(state[:, :INK].astype(np.float32), _PIXELS)
    start = _DiscsInShadow(some, some.terms[1:3] + origin, prior, state, shadow)
    fit = descended(start, most=_STEPS, enough=_ENOUGH)
    shadow, state = fit.shadow, fit.state
    prior = prior_of(surface.lit(shadow), replace(begun, state=state))
    prior = _loosened(prior, begun.noise, slack)
    dimmed = replace(edges, terms=edges.terms * shadow.left(*(edges.terms[1:3] + origin)))
    after = settled(dimmed, state, conics.by_shift, math.sqrt(last.noise), prior)
    return last if after.noise > last.noise else _without(after, shadow, surface, back=True)


def _without(
    progress: Progress, shadow: ShadowEdge, surface: Surface, *, back: bool = False
) -> Progress:
    """Return what is known as it would be without the shadow, or the way back."""
    left = shadow.left(*surface.places.T)
    state = progress.state.copy()
    state[:, LIGHT] *= left if back else 1.0 / left
    return replace(progress, state=state)


def _loosened(prior: Prior, noise: float, slack: tuple[float, float]) -> Prior:
    """Return a prior of the light that allows for what a model of shadows does not know.

    Args:
        prior: Of discs without the shadow.
        noise: Variance of a grey level.
        slack: Grey levels over a length in pixels by which the light may change besides.
    """
    level, length = slack
    precision = prior.precision.copy()
    course = precision[:, COURSE.start - GROWTH :]
    size = level / length ** np.array([1, 1, 2, 2, 2])[: course.shape[1]]
    course /= 1.0 + course * size**2 / noise
    return replace(prior, precision=precision)
