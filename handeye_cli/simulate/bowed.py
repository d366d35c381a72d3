"""A target that is not flat: a paraboloid, and the light of a flat target bent to it.

A pixel that looks at a point (x, y) of the bowed target has the light that the flat target shows
where its own point (x, y) is seen. Which point that is, is exact. The light in between pixels is
interpolated, which a blurred picture allows: discs stay within 0.003 px of their places. Lengths
along the target are those of its plan, which differ from those along the paraboloid by half the
square of its slope.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import normalise, project
from handeye_cli.records import Camera, FloatArray

_SPLINE = 5


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


def bow_of(points: FloatArray, height: float) -> Bow:
    """Return how a target is bent.

    Its points keep their mean depth, so that the target's pose stays what it is.

    Args:
        points: (n, 3) points of the flat target, metres.
        height: How much nearer to the camera the middle is than the farthest point, metres.
    """
    places = points[:, :2]
    centre = (places.min(axis=0) + places.max(axis=0)) / 2.0
    square = _square(places - centre)
    slope = height / float(square.max())
    return Bow(centre, slope, -slope * float(square.mean()))


def bent_light(
    light: FloatArray, camera: Camera, camera_T_target: FloatArray, bow: Bow
) -> FloatArray:
    """Return the light of a bowed target from that of the flat one in its place.

    Beyond the border of the picture its outermost light goes on.

    Args:
        light: (height, width) grey levels of the flat target.
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the target.
        bow: How it is bent.
    """
    from scipy.ndimage import map_coordinates

    v, u = np.indices(light.shape, dtype=np.float64)
    pixels = np.stack([u, v], axis=-1)
    flat = np.pad(_seen(camera, camera_T_target, bow, pixels), ((0, 0), (0, 0), (0, 1)))
    points = se3.transform_points(camera_T_target, flat.reshape(-1, 3))
    column, row = project(points, camera.parameters, camera.model).T
    bent = map_coordinates(light, [row, column], order=_SPLINE, mode="nearest")
    return np.asarray(bent.reshape(light.shape))


def _seen(camera: Camera, camera_T_target: FloatArray, bow: Bow, pixels: FloatArray) -> FloatArray:
    """Return the (..., 2) places of the bowed target that (..., 2) pixels look at.

    A ray o + k d meets the paraboloid where a k^2 + b k + c = 0. The nearer solution, written for
    a slope that may be 0, is 2 c / (-b + sqrt(b^2 - 4 a c)).
    """
    target_T_camera = se3.inverse(camera_T_target)
    rays = normalise(pixels, camera.parameters, camera.model)
    d = np.pad(rays, ((0, 0), (0, 0), (0, 1)), constant_values=1.0) @ target_T_camera[:3, :3].T
    o = target_T_camera[:3, 3] - np.append(bow.centre, bow.offset)
    a = bow.slope * _square(d[..., :2])
    b = 2.0 * bow.slope * (d[..., :2] @ o[:2]) - d[..., 2]
    c = bow.slope * _square(o[:2]) - o[2]
    k = 2.0 * c / (-b + np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)))
    return np.asarray(bow.centre + o[:2] + k[..., None] * d[..., :2])


def _square(v: FloatArray) -> FloatArray:
    return np.asarray(np.sum(v * v, axis=-1))
