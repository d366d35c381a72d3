"""Discs that the edge of a shadow crosses, and that edge, fitted to the discs' pixels together.

Within a disc the edge of a shadow may be sharper than the light's plane or quadratic can follow.
But it is one edge for all discs: few parameters, which the levels of the light all over the plate
tell nearly, and the pixels well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.geometry.disc_edges import Edges, LargeDiscs, LinearEdges
from handeye_cli.geometry.disc_pixels import FloatArray, SingleArray
from handeye_cli.geometry.disc_priors import BoolArray, Surface
from handeye_cli.geometry.disc_steps import (
    COURSE,
    GROWTH,
    INK,
    KEPT,
    LEAST_VARIANCE,
    LIGHT,
    Prior,
    Progress,
    advanced,
    clip_rows,
    foretold,
    kept_columns,
    limited,
    linearised,
    normal_equations,
    with_prior,
    with_terms,
)
from handeye_cli.geometry.light_slopes import POWERS, typical
from handeye_cli.geometry.sensor_limits import held_within
from handeye_cli.geometry.shadow_edge import (
    SPREADS,
    SPREADS_AT_FIRST,
    ShadowEdge,
)
from handeye_cli.geometry.shadow_search import edge_in

_ENOUGH = 100
"""Pixels of a disc that are enough for a first step."""
_SOFT = 0.4
"""Width of an edge, in pitches, from which on levels show so well where it is that steps on some
pixels are left out."""
_MOST_STEPS = 10
_DAMPING, _TINY = 1e-3, 1e-9
"""Steps of the shadow's edge at most, on some pixels and on all; and of these steps."""
_SLACK = 0.006
"""What a shadow's edge may miss of the change of the light over a pitch, in levels."""
_MISSED = 9.0
"""Mean square residuals over the typical ones up to which a disc counts, and beyond for no more."""
_NO_WORSE = 1.03
"""Mean square residual over that without the edge, from pixels that need not be the same."""
_MOST_CLIPPED = 0.4
"""Share of the pixels at the limits of the sensor with which levels still tell of shadows: nearly
half of all see paper."""

Shared = Callable[[Prior, Progress], Prior]
Believed = Callable[[SingleArray, Progress], SingleArray]


@dataclass(frozen=True)
class Before:
    """What is known of discs without the edge of a shadow.

    Attributes:
        discs: The discs.
        surface: Where more is known of the light.
        trusted: (n,) discs whose levels can be trusted.
        shared: What else is known of the discs, by what the light says of them.
    """

    discs: Progress
    surface: Surface
    trusted: BoolArray
    shared: Shared

    def prior_under(self, shadow: ShadowEdge, times: SingleArray) -> Prior:
        """Return what is known of the discs in full light, if this is the shadow's edge.

        Args:
            shadow: The edge.
            times: (n,) by which full light is brighter in the middle of the discs.
        """
        unshaded = _brighter(self.discs.state, times)
        prior = self.surface.lit(shadow).prior(replace(self.discs, state=unshaded), self.trusted)
        level = _SLACK * typical(unshaded[:, LIGHT])
        prior = self.shared(prior, self.discs)
        return _loosened(prior, self.discs.variance, (level, self.surface.pitch))


@dataclass(frozen=True)
class _Known:
    """What is known beforehand.

    Attributes:
        discs: Of the discs in full light.
        variance: Of a grey level.
        shadow: The shadow's edge as levels show it.
        spreads: (k,) standard deviations of its first parameters, which are not held.
    """

    discs: Prior
    variance: float
    shadow: ShadowEdge
    spreads: FloatArray


@dataclass(frozen=True)
class _Stand:
    """What a step in shadow reached.

    Attributes:
        discs: The discs in full light.
        shadow: The shadow's edge.
        residuals: (n, m) grey levels that were left before the step.
    """

    discs: Progress
    shadow: ShadowEdge
    residuals: SingleArray


def shadow_over(edges: Edges, before: Before) -> ShadowEdge | None:
    """Return the edge of a shadow that the levels of the light show, if they tell of shadows.

    Args:
        edges: Pixels of the discs.
        before: What is known without the edge.
    """
    if len(edges.at_limits) > _MOST_CLIPPED * edges.count.sum():
        return None
    surface = before.surface
    return edge_in(surface.light(before.discs, before.trusted), surface.pitch)


def settled_in_shadow(
    edges: LargeDiscs | LinearEdges,
    origin: FloatArray,
    state: FloatArray,
    before: Before,
    shadow: ShadowEdge | None,
    *,
    believed: Believed | None = None,
) -> Progress | None:
    """Fit discs and the edge of a shadow, if there is one and it is sharp.

    Args:
        edges: Pixels of the discs.
        origin: (n, 2) whole pixels from which they are counted.
        state: (n, p) where to start.
        before: What is known without the edge.
        shadow: The edge as levels of the light show it; see `shadow_over`.
        believed: (n, m) weights of the pixels by their residuals, if some are not to be believed.

    Returns:
        What is known with the edge; None if there is none that is sharp and explains the pixels.
    """
    if shadow is None or not shadow.sharp:
        return None
    first, surface = before.discs, before.surface
    times = 1.0 / shadow.left(*surface.places.T)
    prior = before.prior_under(shadow, times)
    begun = _begun(state, times, prior)
    places = edges.terms[1:3] + origin.T[..., None].astype(np.float32)
    step = max(edges.grey.shape[1] // _ENOUGH, 1)
    roughly = _Known(prior, first.variance, shadow, SPREADS_AT_FIRST)
    known = replace(roughly, spreads=SPREADS)
    stand = _Stand(replace(first, state=begun), shadow.softened, edges.grey)
    if shadow.width < _SOFT:
        stand = _settled(edges.every(step), places[..., ::step], stand, roughly)
    stand = _settled(edges, places, stand, known)
    if believed is not None:
        weight = believed(stand.residuals, stand.discs)
        edges = replace(edges, weight=weight, grey=edges.grey * weight)
    if believed is not None or edges.clipped:
        stand = _stepped(edges, places, stand, known)
    return _as_seen(stand, surface) if _explained(stand.discs, first) else None


def _explained(discs: Progress, first: Progress) -> bool:
    """Return whether residuals are no worse than without the edge, no disc counting for much."""
    most = _MISSED * typical(first.relative)
    here, before = (np.mean(np.minimum(each.relative, most)) for each in (discs, first))
    return bool(here <= _NO_WORSE * before)


def _begun(state: FloatArray, times: SingleArray, prior: Prior) -> FloatArray:
    """Return the (n, p) state in full light, so many times as bright, which a prior tells of."""
    begun = with_terms(_brighter(state[:, : LIGHT + 1], times), GROWTH + prior.mean.shape[1])
    begun[:, COURSE] = prior.mean[:, COURSE.start - GROWTH :]
    return begun


def _as_seen(stand: _Stand, surface: Surface) -> Progress:
    """Return discs with the light that is left of the full one in the middle of each."""
    left = stand.shadow.left(*surface.places.T)
    return replace(stand.discs, state=_brighter(stand.discs.state, left))


def _settled(edges: Edges, places: SingleArray, stand: _Stand, known: _Known) -> _Stand:
    """Return discs and shadow after steps until the shadow rests."""
    for _ in range(_MOST_STEPS):
        before, stand = stand, _stepped(edges, places, stand, known)
        if stand.shadow.rests_since(before.shadow):
            break
    return stand


def _stepped(edges: Edges, places: SingleArray, stand: _Stand, known: _Known) -> _Stand:
    """Return discs and shadow after a step.

    The normal equations are those of the discs, one by one, bordered by the shadow's. What the
    shadow leaves unknown is part of the discs' covariances.
    """
    state, shadow, free = stand.discs.state, stand.shadow, len(known.spreads)
    rows = _rows(edges, places, state, shadow, free)
    noise = math.sqrt(known.variance)
    count = edges.count - clip_rows(edges, rows, noise)
    normal, wanted, squares = normal_equations(rows)
    own, right = normal[:, free:, free:], wanted[:, free:]
    if edges.clipped:
        own, right = held_within(own, right, state, (LIGHT, INK), noise)
    own, right = with_prior(own, right, state, known.discs)
    both = normal[:, free:, :free]
    kept = np.broadcast_to(kept_columns(state.shape[1]), (*state.shape, len(KEPT)))
    solved = np.linalg.solve(own, np.concatenate([both, right[..., None], kept], axis=2))
    by_shadow, alone = solved[..., :free], solved[..., free]
    border = normal[:, :free, :free] - np.swapaxes(both, 1, 2) @ by_shadow
    due = wanted[:, :free] - np.sum(both * alone[..., None], axis=1)
    precision = known.variance / known.spreads**2
    weight = _believed(squares / np.maximum(count, 1.0))
    inverse = _inverse(weight @ border.reshape(len(border), -1), precision)
    off = (shadow.parameters - known.shadow.parameters)[:free]
    moved = shadow.moved(inverse @ (weight @ due - off * precision))
    turn = (moved.parameters - shadow.parameters)[:free]
    step = limited(alone - by_shadow @ turn)
    spread = solved[..., free + 1 :]
    spread = spread + by_shadow @ inverse @ np.swapaxes(by_shadow[:, KEPT], 1, 2)
    change = np.concatenate([np.broadcast_to(turn, (len(step), free)), step], axis=1)
    squares = foretold(squares, normal, wanted, change)
    return _Stand(Progress(advanced(state, step), spread, squares, count), moved, rows[-1])


def _believed(relative: FloatArray) -> FloatArray:
    """Return the (n,) weights of discs by their mean square residuals, 1 but for those stained."""
    most = max(_MISSED * typical(relative), LEAST_VARIANCE)
    return np.asarray(most / np.maximum(relative, most))


def _rows(
    edges: Edges, places: SingleArray, state: FloatArray, shadow: ShadowEdge, free: int
) -> SingleArray:
    """Return derivatives by so many parameters of the shadow, then what `linearised` has."""
    rows = np.empty((free + state.shape[1] + 1, *edges.grey.shape), dtype=np.float32)
    slopes = rows[:free]
    left = shadow.with_slopes(places[0], places[1], slopes)
    dimmed = replace(edges, terms=edges.terms[: state.shape[1] - LIGHT] * left)
    linearised(dimmed, state, out=rows[free:])
    seen = edges.grey - rows[-1]
    seen /= left
    slopes *= seen
    return rows


def _inverse(border: FloatArray, precision: FloatArray) -> FloatArray:
    """Return the (k, k) inverse of the normal matrix of a shadow's edge, damped.

    Args:
        border: (k * k,) the matrix.
        precision: (k,) what its diagonal has besides.
    """
    count = len(precision)
    diagonal = border[:: count + 1]
    diagonal += precision
    diagonal *= 1.0 + _DAMPING
    diagonal += _TINY
    return np.asarray(np.linalg.inv(border.reshape(count, count)))


def _brighter(state: FloatArray, times: FloatArray | SingleArray) -> FloatArray:
    """Return a (n, p) state in light that is (n,) times as bright in the middle of the discs."""
    out = state.copy()
    out[:, LIGHT] *= times
    return out


def _loosened(prior: Prior, variance: float, slack: tuple[float, float]) -> Prior:
    """Return a prior of the light that allows for what a model of shadows does not know.

    Args:
        prior: Of discs without the shadow.
        variance: Of a grey level.
        slack: Grey levels over a length in pixels by which the light may change besides.
    """
    level, length = slack
    precision = prior.precision.copy()
    course = precision[:, COURSE.start - GROWTH :]
    size = level / length ** POWERS[: course.shape[1]]
    course /= 1.0 + course * size**2 / variance
    return replace(prior, precision=precision)
