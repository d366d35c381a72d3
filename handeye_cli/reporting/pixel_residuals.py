"""How far the target's points are from where each station's own pose puts them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import targets
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project_jacobians
from handeye_cli.records import FloatArray, IntArray, Stations
from handeye_cli.views import Views, views_of

_CELLS = 16
"""Cells across the longer side of an image, over which residuals are averaged."""

_EDGE = 1.0
"""Square pixels for a square metre of the plate, below which it is seen from its edge."""


@dataclass(frozen=True)
class Arrows:
    """Mean residuals at m places.

    Attributes:
        places: (m, 2) in the image, pixels, or on the plate, metres.
        means: (m, 2) residuals, seen minus expected, in the unit and along the axes of the places.
        counts: (m,) residuals behind each mean.
    """

    places: FloatArray
    means: FloatArray
    counts: IntArray


@dataclass(frozen=True)
class PixelResiduals:
    """Residuals of all points of all stations, in the image.

    Attributes:
        size: Width and height of the image, pixels.
        pixels: (n, 2) where points were seen.
        residuals: (n, 2) seen minus expected, pixels.
        rms: Of one coordinate, pixels.
        image: Their means over cells of the image.
        plate: Their means at each point of the plate.
    """

    size: tuple[int, int]
    pixels: FloatArray
    residuals: FloatArray
    rms: float
    image: Arrows
    plate: Arrows


def pixel_residuals(stations: Stations) -> PixelResiduals | None:
    """Compare what stations saw with what their own poses and the intrinsics make of the target.

    None where there are no pixels, no intrinsics or no target.

    Args:
        stations: Poses, and the points they come from.

    Raises:
        InputError: A station saw a point that its target has not.
    """
    if stations.target is None or stations.camera is None:
        return None
    usable = [
        each if each.camera_T_target is not None else replace(each, observation=None)
        for each in stations.stations
    ]
    points = targets.build(stations.target).points()
    views = views_of(usable, points)
    if not len(views.index):
        return None
    chosen = [usable[i].camera_T_target for i in views.index]
    poses = np.stack([pose.matrix for pose in chosen if pose is not None])
    lens = stations.camera.lens
    here = se3.transform_points(poses, points)
    expected, slopes, _ = project_jacobians(here, lens.parameters, lens.model)
    by_plate = slopes @ poses[:, None, :3, :2]
    # a plate seen from its edge shows no point's place on it
    mask = views.seen.mask & (here[..., 2] > 0.0) & (np.abs(np.linalg.det(by_plate)) > _EDGE)
    if not mask.any():
        return None
    views = replace(views, seen=replace(views.seen, mask=mask))
    off = (views.seen.pixels - expected)[mask]
    on_plate = np.linalg.solve(by_plate[mask], off[..., None])[..., 0]
    size = (stations.camera.width, stations.camera.height)
    return _averaged(views, off, on_plate, size)


def _averaged(
    views: Views, off: FloatArray, on_plate: FloatArray, size: tuple[int, int]
) -> PixelResiduals:
    """Return residuals with their means.

    Args:
        views: What was seen; k points in all.
        off: (k, 2) residuals in the image, pixels.
        on_plate: (k, 2) the same as displacements of the points on the plate, metres.
        size: Width and height of the image.
    """
    mask, points = views.seen.mask, views.seen.points
    pixels = views.seen.pixels[mask]
    ids = np.broadcast_to(np.arange(len(points)), mask.shape)[mask]
    side = max(size) / _CELLS
    cells = np.clip(np.floor((pixels + 0.5) / side), 0, _CELLS - 1).astype(np.int64)
    places, means, counts, _ = _means(cells[:, 1] * _CELLS + cells[:, 0], pixels, off)
    image = Arrows(places, means, counts)
    _, means, counts, seen = _means(ids, pixels, on_plate)
    return PixelResiduals(
        size=size,
        pixels=pixels,
        residuals=off,
        rms=float(np.sqrt(np.mean(off**2))),
        image=image,
        plate=Arrows(points[seen, :2], means, counts),
    )


def _means(
    keys: IntArray, places: FloatArray, residuals: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray, IntArray]:
    """Return mean places and residuals of those with the same key, their numbers, and the keys."""
    unique, back, counts = np.unique(keys, return_inverse=True, return_counts=True)
    total = np.zeros((len(unique), 4))
    np.add.at(total, back, np.concatenate([places, residuals], axis=1))
    means = total / counts[:, None]
    return means[:, :2], means[:, 2:], counts, unique
