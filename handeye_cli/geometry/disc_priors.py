"""What is known of discs before their edges are fitted: how the light goes, and what they share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.disc_paper import Patchwork
from handeye_cli.geometry.disc_pixels import FloatArray
from handeye_cli.geometry.disc_steps import BLUR, GROWTH, KEPT_LIGHT, LIGHT, Prior, Progress
from handeye_cli.geometry.light_slopes import (
    Course,
    Light,
    bent_course,
    course_of_light,
    even_course,
    pitch_of,
    typical,
)
from handeye_cli.geometry.shadow_edge import ShadowEdge

_UNEVEN = 0.01
"""What the edge of a shadow misses of levels beside it, in levels."""

BoolArray = NDArray[np.bool_]

_SHARED = slice(0, LIGHT - GROWTH)
"""Where a prior has growth, blur and ink."""


@dataclass(frozen=True)
class Surface:
    """Where the light of a plate is known.

    Attributes:
        places: (n, 2) images of the discs, pixels.
        paper: Patches between them.
        uneven: Standard deviation of levels about any smooth course, in levels.
    """

    places: FloatArray
    paper: Patchwork
    uneven: float = 0.0

    def lit(self, edge: ShadowEdge) -> Surface:
        """Return the surface as it would be without a shadow."""
        paper = self.paper
        level = paper.level / edge.left(*paper.places.T)
        return replace(self, paper=replace(paper, level=level), uneven=_UNEVEN)

    def light(self, progress: Progress, sound: BoolArray) -> Light:
        """Return the levels of the light all over the plate.

        Args:
            progress: Levels of the light at the discs.
            sound: (n,) discs whose levels can be trusted.
        """
        variance, paper = progress.variance, self.paper
        spread = variance * progress.spread[sound, LIGHT, KEPT_LIGHT]
        level = np.concatenate([progress.state[sound, LIGHT], paper.level])
        told = np.concatenate([spread, np.full(len(paper.level), variance / paper.count)])
        return Light(
            np.concatenate([self.places[sound], paper.places]),
            level,
            told + (self.uneven * level) ** 2,
            np.arange(len(level)) < len(spread),
        )

    @cached_property
    def pitch(self) -> float:
        """Typical distance between discs, pixels."""
        return pitch_of(self.places)

    def prior(self, progress: Progress, sound: BoolArray) -> Prior:
        """Return how the light should go over each disc, by its `light`."""
        course = course_of_light(self.light(progress, sound), self.places)
        return self._prior(course, progress)

    def even_prior(self, progress: Progress, sound: BoolArray) -> Prior | None:
        """Return the same, None where shadows fall."""
        course = even_course(self.light(progress, sound), self.places)
        return None if course is None else self._prior(course, progress)

    def bent_prior(self, progress: Progress, sound: BoolArray) -> Prior:
        """Return the same where shadows fall, which `even_prior` has told."""
        return self._prior(bent_course(self.light(progress, sound), self.places), progress)

    def _prior(self, course: Course, progress: Progress) -> Prior:
        unknown = np.zeros((len(self.places), LIGHT + 1 - GROWTH))
        return Prior(
            np.concatenate([unknown, course.mean], axis=1),
            np.concatenate([unknown, progress.variance / course.variance], axis=1),
        )


def alike(
    prior: Prior, state: FloatArray, variance: float, spread: tuple[float, float, float]
) -> Prior:
    """Return the prior for discs that are printed and seen much alike.

    Args:
        prior: What else is known.
        state: (n, p) parameters of the discs as far as they are known.
        variance: Of a grey level.
        spread: Standard deviations among discs of the growth, the blur as a share of it, the ink.
    """
    mean, precision = prior.mean.copy(), prior.precision.copy()
    mean[:, _SHARED] = [typical(each) for each in state[:, GROWTH:LIGHT].T]
    deviation = np.array(spread) * [1.0, mean[0, BLUR - GROWTH], 1.0]
    precision[:, _SHARED] = variance / deviation**2
    return Prior(mean, precision)
