"""A target that is not flat but a paraboloid: where a ray meets it, and how flat it is seen.

Lengths along the target are those of its plan, which differ from those along the paraboloid by half
the square of its slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.extent import middle_of
from handeye_cli.records import FloatArray

_FLATTEST = 10.0
"""Degrees between ray and surface. At 0 the target begins to hide a part of itself, and near it a
few pixels see so much of the surface that its outlines in them are no longer straight."""
_PLACES = 17
"""Places along each side of a target at which that angle is looked at."""


@dataclass(frozen=True)
class Bow:
    """The paraboloid z = offset + slope |(x, y) - centre|^2 in the target's frame.

    Attributes:
        centre: (2,) middle of the target, metres.
        slope: 1 / metres; above 0 where the middle is nearer to the camera than the rim.
        offset: z of the middle, metres.
    """

    centre: FloatArray
    slope: float
    offset: float

    def depth(self, places: FloatArray) -> FloatArray:
        """Return z, metres, at (..., 2) places of the target."""
        return np.asarray(self.offset + self.slope * _square(places - self.centre))

    def lifted(self, places: FloatArray) -> FloatArray:
        """Return the (..., 3) points of the surface, metres, at (..., 2) places of the target."""
        return np.concatenate([places, self.depth(places)[..., None]], axis=-1)

    def met(self, origin: FloatArray, rays: FloatArray) -> FloatArray:
        """Return the (..., 2) places at which rays meet the front of the surface.

        A ray o + k d meets it where a k^2 + b k + c = 0; of the two solutions the front has the one
        at which a k^2 + b k + c falls. A ray that misses it, or would meet it behind its origin, is
        taken to where the surface vanishes from sight in its direction.

        Args:
            origin: (3,) of the rays, in the target's frame.
            rays: (..., 2) how far they go in x and y for each metre in z.
        """
        o = origin - np.append(self.centre, self.offset)
        k = -o[2] if self.slope == 0.0 else self._depths(o, rays)[..., None]
        return np.asarray(self.centre + o[:2] + k * rays)

    def _depths(self, o: FloatArray, rays: FloatArray) -> FloatArray:
        """Return the (...) k of the equation above, of rays from (3,) o as seen from the middle."""
        a, c = self.slope * _square(rays), self.slope * _square(o[:2]) - o[2]
        b = 2.0 * self.slope * (rays @ o[:2]) - 1.0
        square = b * b - 4.0 * a * c
        missed = (a * c > 0.0) & ((square < 0.0) | (a * b > 0.0))
        root = np.sqrt(np.maximum(square, 0.0))
        # Each of the two forms adds numbers of one sign, so that no digits are lost.
        above, below = np.where(b > 0.0, -(b + root), 2.0 * c), np.where(b > 0.0, 2.0 * a, root - b)
        met = above / np.where(missed, 1.0, below)
        rim = np.sqrt(np.abs(c / np.where(missed, a, 1.0)))
        return np.asarray(np.where(missed, rim, met))

    def sines(self, origin: FloatArray, places: FloatArray) -> FloatArray:
        """Return the (...) sines of the angles between surface and rays, below 0 from behind.

        Args:
            origin: (..., 3) of the rays, in the target's frame.
            places: (..., 2) of the target, where the rays end.
        """
        rays = self.lifted(places) - origin
        slopes = -2.0 * self.slope * (places - self.centre)
        along = np.sum(slopes * rays[..., :2], axis=-1) + rays[..., 2]
        return np.asarray(along / np.sqrt((1.0 + _square(slopes)) * _square(rays)))


FLAT = Bow(np.zeros(2), 0.0, 0.0)
"""A target without a bow."""


def bow_of(points: FloatArray, height: float) -> Bow:
    """Return how a target is bent.

    Its points keep their mean depth, so that the target's pose stays what it is.

    Args:
        points: (n, 3) points of the flat target, metres.
        height: How much nearer to the camera the middle is than the farthest point, metres; 0 is
            `FLAT`.
    """
    if height == 0.0:
        return FLAT
    places = points[:, :2]
    centre = middle_of(places)
    square = _square(places - centre)
    slope = height / float(square.max())
    return Bow(centre, slope, -slope * float(square.mean()))


def require_seen(bow: Bow, camera_T_target: FloatArray, extent: FloatArray) -> None:
    """Refuse a bow at which part of the target turns away from the camera.

    Args:
        bow: How the target is bent; a flat one is never refused.
        camera_T_target: (..., 4, 4) poses of the target.
        extent: (2, 2) smallest and largest x, y of what is on it, metres.

    Raises:
        UsageError: The camera sees a part of it flatter than 10 degrees, or not at all.
    """
    if bow.slope == 0.0:
        return
    x, y = np.linspace(extent[0], extent[1], _PLACES).T
    places = np.stack(np.meshgrid(x, y), axis=-1)
    sines = bow.sines(se3.inverse(camera_T_target)[..., None, None, :3, 3], places)
    flattest = math.degrees(math.asin(float(sines.min())))
    if flattest < _FLATTEST:
        raise UsageError(
            f"expected a bow at which all of the target is seen at {_FLATTEST:g} deg or more from "
            f"its surface, found {flattest:.3g} deg",
            where="--fault bowed",
            hint="take a smaller bow or a smaller tilt",
        )


def _square(v: FloatArray) -> FloatArray:
    return np.asarray(np.sum(v * v, axis=-1))
