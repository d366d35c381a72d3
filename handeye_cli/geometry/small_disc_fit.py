"""The last rounds of the fit of small discs, whose every pixel has to do with all that is around.

Near an edge that is blurred over half of its disc nothing is bare paper. The course of the light is
learned from the discs themselves, round by round, and pixels that see something else than discs and
paper, such as the end of the plate, are found by what the fit leaves of them.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from handeye_cli.geometry.disc_conics import Conics
from handeye_cli.geometry.disc_edges import Edges, LinearEdges
from handeye_cli.geometry.disc_pixels import FloatArray, SingleArray
from handeye_cli.geometry.disc_priors import BoolArray, Surface, alike
from handeye_cli.geometry.disc_steps import (
    BLUR,
    INK,
    LEAST_VARIANCE,
    LIGHT,
    Prior,
    Progress,
    linearised,
    settled,
)
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.shadow_fit import Before, settled_in_shadow, shadow_over
from handeye_cli.geometry.small_discs import SmallDiscs

_SPREAD_AT_FIRST, _SPREAD = (0.05, 0.2, 0.1), (0.01, 0.05, 0.02)
"""By how much growth, blur (as a share of it) and ink may differ among discs."""
_ROUNDS, _STILL = 5, 0.97
"""Rounds at most; a last one makes the noise that is left hardly less than this many times."""
_STRANGE = 4.0
"""Residual over the noise of a pixel that sees something else."""
_ASTRAY = 0.3
"""How far the edges of some discs may be from where they are at first, in pixels; half as far after
each round. Pixels at the end of the plate lead the discs next to it astray, and as long as they do
the good pixels of these look strange too."""
_BY_CHANCE = 1e-3
"""Share of the pixels that look strange and need not be."""
_STEEPEST = 1.0 / math.sqrt(2.0 * math.pi)
"""Change of a blurred edge over a blur, in contrasts."""
_WHOLE = 0.95
"""Share of a disc's pixels that see what they should, from which on its light can be trusted."""
_FEWEST = 9
"""Discs that are enough to tell the course of the light over a plate."""


def settled_small(
    discs: SmallDiscs, state: FloatArray, conics: Conics, first: Progress, surface: Surface
) -> Progress:
    """Take steps until small discs stay where they are.

    Args:
        discs: The discs and their pixels.
        state: (n, p) where to start.
        conics: Their outlines.
        first: What is known.
        surface: Where more can be learned of the light.
    """
    prior = alike(surface.prior(first, first.sound), state, first.variance, _SPREAD_AT_FIRST)

    def believed(residuals: SingleArray, last: Progress) -> SingleArray:
        return discs.without(_strange(residuals, last, 0.0)).weight

    near = _linear(discs.roughly(), state)
    last = settled(near, state, conics.by_shift, math.sqrt(first.variance), prior)
    near = whole = _linear(discs, last.state)
    for k in range(_ROUNDS):
        strange = _strange(linearised(near, last.state)[-1], last, _ASTRAY * 0.5**k)
        near = _without(near, discs.without(strange))
        trusted = _trusted(near, discs, last)
        prior = _alike(surface.prior(last, trusted), last)
        variance = last.variance
        last = settled(near, last.state, conics.by_shift, math.sqrt(variance), prior)
        if last.variance > _STILL * variance and _all_told(whole, strange, last):
            break
        near = whole = _linear(discs, last.state)
    if not prior.bent:
        return last
    # what was strange in an even light need not be in a shadow
    before = Before(last, surface, last.sound, _alike)
    shadow = shadow_over(whole, before)
    shadowed = settled_in_shadow(
        whole, conics.origin, last.state, before, shadow, believed=believed
    )
    return last if shadowed is None else shadowed


def _all_told(whole: LinearEdges, strange: BoolArray, last: Progress) -> bool:
    """Return whether hardly a pixel is strange besides, now that discs are where they are."""
    besides = _strange(linearised(whole, last.state)[-1], last, 0.0) & ~strange
    return bool(np.sum(besides) < _BY_CHANCE * np.sum(whole.count))


def _alike(prior: Prior, last: Progress) -> Prior:
    return alike(prior, last.state, last.variance, _SPREAD)


def _linear(discs: SmallDiscs, state: FloatArray) -> LinearEdges:
    """Return discs linearised in their shape, as steps are small and the exact image is slow."""
    shape = state[:, :INK].astype(np.float32)
    shape[:, BLUR] = typical(state[:, BLUR])
    return discs.linear(shape)


def _without(near: LinearEdges, some: SmallDiscs) -> LinearEdges:
    return replace(near, weight=some.weight, grey=some.grey, at_limits=some.at_limits)


def _strange(residuals: SingleArray, last: Progress, astray: float) -> BoolArray:
    """Return the (n, m) pixels that see neither discs nor paper, by their residuals.

    Args:
        residuals: (n, m) of the pixels.
        last: What is known of the discs.
        astray: How far edges may be from where they are, pixels.
    """
    contrast = typical(np.abs(last.state[:, LIGHT] * (1.0 - last.state[:, INK])))
    noise = _STRANGE * math.sqrt(max(typical(last.relative), LEAST_VARIANCE))
    missed = astray * _STEEPEST * contrast / last.blur
    return np.asarray(np.abs(residuals) > math.hypot(noise, missed))


def _trusted(near: Edges, discs: SmallDiscs, last: Progress) -> BoolArray:
    """Return the (n,) discs whose light is known, those beside strange pixels only if need be."""
    whole = last.sound & (near.count > _WHOLE * discs.held.sum(axis=1))
    return whole if whole.sum() > _FEWEST else last.sound
