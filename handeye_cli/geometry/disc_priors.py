"""What is known of discs before their edges are fitted: how the light goes, and what they share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.disc_paper import Patchwork
from handeye_cli.geometry.disc_pixels import FloatArray
from handeye_cli.geometry.disc_steps import BLUR, GROWTH, KEPT_LIGHT, LIGHT, Prior, Progress
from handeye_cli.geometry.light_slopes import Light, course_of_light, typical
from handeye_cli.geometry.shadow_edge import ShadowEdge

BoolArray = NDArray[np.bool_]

_SHARED = slice(0, LIGHT - GROWTH)
"""Where a prior has growth, blur and ink."""


@dataclass(frozen=True)
class Surface:
    """Where the light of a plate is known.

    Attributes:
        places: (n, 2) images of the discs, pixels.
        paper: Patches between them.
    """

    places: FloatArray
    paper: Patchwork

    def lit(self, edge: ShadowEdge) -> Surface:
        """Return the surface as it would be without a shadow."""
        paper = self.paper
        level = paper.level / edge.left(*paper.places.T)
        return replace(self, paper=replace(paper, level=level))

    def light(self, progress: Progress, sound: BoolArray) -> Light:
        """Return the levels of the light all over the plate.

        Args:
            progress: Levels of the light at the discs.
            sound: (n,) discs whose levels can be trusted.
        """
        noise, paper = progress.noise, self.paper
        spread = noise * progress.spread[sound, LIGHT, KEPT_LIGHT]
        return Light(
            np.concatenate([self.places[sound], paper.places]),
            np.concatenate([progress.state[sound, LIGHT], paper.level]),
            np.concatenate([spread, np.full(len(paper.level), noise / paper.count)]),
            np.repeat([True, False], [int(sound.sum()), len(paper.level)]),
        )

    def prior(self, progress: Progress, sound: BoolArray) -> Prior:
        """Return how the light should go over each disc, by its `light`."""
        course = course_of_light(self.light(progress, sound), self.places)
        unknown = np.zeros((len(self.places), LIGHT + 1 - GROWTH))
        return Prior(
            np.concatenate([unknown, course.mean], axis=1),
            np.concatenate([unknown, progress.noise / course.variance], axis=1),
        )


def alike(
    prior: Prior, state: FloatArray, noise: float, spread: tuple[float, float, float]
) -> Prior:
    """Return the prior for discs that are printed and seen much alike.

    Args:
        prior: What else is known.
        state: (n, p) parameters of the discs as far as they are known.
        noise: Variance of a grey level.
        spread: Standard deviations among discs of the growth, the blur as a share of it, the ink.
    """
    mean, precision = prior.mean.copy(), prior.precision.copy()
    mean[:, _SHARED] = [typical(each) for each in state[:, GROWTH:LIGHT].T]
    deviation = np.array(spread) * [1.0, mean[0, BLUR - GROWTH], 1.0]
    precision[:, _SHARED] = noise / deviation**2
    return Prior(mean, precision)
