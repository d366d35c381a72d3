"""Errors of a predicted camera in the image, and on the plate where its lines of sight end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import Lens, normalise, project
from handeye_cli.geometry.pnp import BoolArray, Sightings
from handeye_cli.records import Camera, FloatArray, IntArray, Stations


@dataclass(frozen=True)
class PixelErrors:
    """RMS errors of M stations; NaN where a station has no pixels, or they cannot be predicted.

    Attributes:
        reprojection: (M,) distance between points as predicted and as seen, pixels.
        plate: (M,) distance, on the target's plane, from a point to where the line of sight of its
            pixel ends, metres.
    """

    reprojection: FloatArray
    plate: FloatArray


def pixel_errors(
    stations: Stations, index: IntArray, poses: FloatArray, camera: Camera | None
) -> PixelErrors:
    """Compare what stations saw of the target with where it was expected.

    Args:
        stations: The document, with pixels and target where there are any.
        index: (M,) positions of the stations in it.
        poses: (M, 4, 4) expected camera_T_target.
        camera: The intrinsics, or None when they are unknown.
    """
    unknown = np.full(len(index), np.nan)
    found = PixelErrors(unknown, unknown.copy())
    chosen = tuple(stations.stations[i] for i in index)
    nothing_seen = all(station.observation is None for station in chosen)
    if stations.target is None or camera is None or nothing_seen:
        return found
    from handeye_cli import targets
    from handeye_cli.views import views_of

    views = views_of(chosen, targets.build(stations.target).points())
    lens, expected = camera.lens, poses[views.index]
    found.reprojection[views.index] = _reprojection(views.seen, expected, lens)
    found.plate[views.index] = _on_plate(views.seen, expected, lens)
    return found


def _reprojection(seen: Sightings, poses: FloatArray, lens: Lens) -> FloatArray:
    points = se3.transform_points(poses, seen.points)
    apart = project(points, lens.parameters, lens.model) - seen.pixels
    return _rms(apart, seen.mask & (points[..., 2] > 0.0), seen.mask)


def _on_plate(seen: Sightings, poses: FloatArray, lens: Lens) -> FloatArray:
    pixels = np.where(seen.mask[..., None], seen.pixels, lens.parameters[2:4])
    directions = normalise(pixels, lens.parameters, lens.model)
    ahead = np.concatenate([directions, np.ones((*directions.shape[:-1], 1))], axis=-1)
    target_T_camera = se3.inverse(poses)
    eye = target_T_camera[:, None, :3, 3]
    sight = ahead @ np.swapaxes(target_T_camera[:, :3, :3], -1, -2)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = -eye[..., 2] / sight[..., 2]
        touched = eye + reach[..., None] * sight
    return _rms((touched - seen.points)[..., :2], seen.mask & (reach > 0.0), seen.mask)


def _rms(apart: FloatArray, valid: BoolArray, mask: BoolArray) -> FloatArray:
    """Return the (N,) RMS lengths over the masked points, NaN unless all of them are valid."""
    squares = np.where(mask, np.sum(apart**2, axis=-1), 0.0)
    rms = np.sqrt(squares.sum(axis=-1) / mask.sum(axis=-1))
    return np.where(np.all(valid == mask, axis=-1), rms, np.nan)
