"""Where points of a target's plane lie in an image, from the points that were found in it."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import pnp
from handeye_cli.geometry.camera import Lens, PlateToPixel, normalise, project
from handeye_cli.records import Camera, FloatArray


def plate_map(plate: FloatArray, pixels: FloatArray, camera: Camera | None) -> PlateToPixel:
    """Return the map from a target's plane to pixels that fits points of it best.

    Args:
        plate: (n, 2) points in the target's plane, metres; at least four, not on one line.
        pixels: (n, 2) their images.
        camera: Intrinsics; without them a plane without distortion is assumed.

    Returns:
        A function of (..., 2) points of the plane, metres, that gives their (..., 2) pixels.
    """
    points = np.pad(plate, ((0, 0), (0, 1)))
    mask = np.ones(len(points), dtype=bool)
    lens = None if camera is None else camera.lens
    directions = None if lens is None else normalise(pixels, lens.parameters, lens.model)
    # A lens that leaves pixels without a direction cannot be right: as good as none.
    if lens is None or directions is None or not np.all(np.isfinite(directions)):
        H = pnp.homography(plate, pixels, mask)
        return lambda p: _projective(H, p)
    # Which of the two planar poses it is makes no difference to the shape of a disc.
    start = pnp.pose_from_homography(pnp.homography(plate, directions, mask))
    pose, _ = pnp.refine(start, pnp.Sightings(points, pixels, mask), lens)
    return lambda p: _through_camera(pose, lens, p)


def _projective(H: FloatArray, plate: FloatArray) -> FloatArray:
    mapped = plate @ H[:, :2].T + H[:, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:])


def _through_camera(pose: FloatArray, lens: Lens, plate: FloatArray) -> FloatArray:
    here = plate @ pose[:3, :2].T + pose[:3, 3]
    return project(here, lens.parameters, lens.model)
