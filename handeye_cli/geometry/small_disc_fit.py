"""The last rounds of the fit of small discs, whose every pixel has to do with all that is around.

Near an edge that is blurred over half of its disc nothing is bare paper. The course of the light is
learned from the discs themselves, round by round, and pixels that see something else than discs and
paper, such as the end of the plate, are found by what the fit leaves of them.
"""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.geometry.disc_conics import Conics
from handeye_cli.geometry.disc_pixels import FloatArray
from handeye_cli.geometry.disc_priors import BoolArray, Surface, alike
from handeye_cli.geometry.disc_steps import LEAST_VARIANCE, Prior, Progress, linearised, settled
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.shadow_fit import settled_in_shadow
from handeye_cli.geometry.small_discs import SmallDiscs

_SPREAD_AT_FIRST, _SPREAD = (0.05, 0.2, 0.1), (0.01, 0.05, 0.02)
"""By how much growth, blur (as a share of it) and ink may differ among discs."""
_ROUNDS, _STILL = 4, 0.97
"""Rounds at most; a last one makes the noise that is left hardly less than this many times."""
_STRANGE = 4.0
"""Residual over the noise of a pixel that sees something else."""
_WHOLE = 0.95
"""Share of a disc's pixels that see what they should, from which on its light can be trusted."""
_FEWEST = 9
"""Discs that are enough to tell the course of the light over a plate."""


def settled_small(
    discs: SmallDiscs,
    state: FloatArray,
    conics: Conics,
    noise: float,
    light: tuple[Surface, Prior],
) -> Progress:
    """Take steps until small discs stay where they are.

    Args:
        discs: The discs and their pixels.
        state: (n, p) where to start.
        conics: Their outlines.
        noise: Variance of a grey level, as far as it is known.
        light: Where more can be learned of the light, and what is known.
    """
    surface, prior = light
    some = discs

    def prior_of(surface: Surface, last: Progress) -> Prior:
        return alike(surface.prior(last, _trusted(some, last)), last.state, last.noise, _SPREAD)

    prior = alike(prior, state, noise, _SPREAD_AT_FIRST)
    last = settled(some, state, conics.by_shift, math.sqrt(noise), prior)
    for _ in range(_ROUNDS):
        before = last.noise
        some = discs.without(_strange(discs, last))
        prior = prior_of(surface, last)
        last = settled(some, last.state, conics.by_shift, math.sqrt(last.noise), prior)
        if last.noise > _STILL * before:
            break
    if prior.bent and not some.clipped:
        return settled_in_shadow(some, conics, last, surface, prior_of)
    return last


def _strange(discs: SmallDiscs, last: Progress) -> BoolArray:
    """Return the (n, m) pixels that see neither discs nor paper."""
    noise = math.sqrt(max(typical(last.relative), LEAST_VARIANCE))
    return np.asarray(np.abs(linearised(discs, last.state)[-1]) > _STRANGE * noise)


def _trusted(discs: SmallDiscs, last: Progress) -> BoolArray:
    """Return the (n,) discs whose light is known, those beside strange pixels only if need be."""
    whole = last.sound & (discs.count > _WHOLE * discs.held.sum(axis=1))
    return whole if whole.sum() > _FEWEST else last.sound
