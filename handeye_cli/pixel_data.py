"""The pixels behind the target poses of a stations document, and the intrinsics they share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import targets
from handeye_cli.chain import Chain, has_pixels
from handeye_cli.errors import InputError
from handeye_cli.geometry import joint_bundle, pnp
from handeye_cli.records import Camera, FloatArray, IntArray, Station, Stations
from handeye_cli.views import Views, views_of

CALIBRATED = "intrinsics-calibrated"
"""Code of the finding that says that the intrinsics come from the stations' own images."""
LEAST_SIGMA = 1e-6
"""Pixel noise below this is taken as this."""
_STRANGE_FACTOR = 40.0
_STRANGE_PIXELS = 2.0
"""Pixels whose residual is above both, the factor times their noise, are not those of the pose."""


@dataclass(frozen=True)
class PixelData:
    """All M stations of a document with a target pose and the pixels it comes from.

    Attributes:
        views: What they saw.
        poses: (M, 4, 4) camera_T_target of the document.
        sigma: (M,) pixel noise.
        camera: The intrinsics that these poses rest on.
        directions: (4 + k, m) root of the intrinsics' covariance; m is 0 where they are exact.
        calibrated: Whether the intrinsics come from these very images.
    """

    views: Views
    poses: FloatArray
    sigma: FloatArray
    camera: Camera
    directions: FloatArray
    calibrated: bool

    def seen(self, rows: IntArray) -> pnp.Sightings:
        """Return the views of some rows."""
        return self.views.seen.part(rows)

    def rows(self, chain: Chain) -> IntArray:
        """Return the rows of a chain's stations."""
        return np.searchsorted(self.views.index, chain.index)

    def information(self, rows: IntArray) -> joint_bundle.ViewInformation:
        """Return what the pixels of some rows say around the document's poses."""
        return joint_bundle.view_information(
            self.poses[rows], self.seen(rows), self.sigma[rows], self.camera.lens, self.directions
        )


def with_intrinsics(stations: Stations, chain: Chain) -> Chain:
    """Return a chain that knows how its target poses move with errors of the intrinsics.

    It is the same chain where there are no pixels, or the intrinsics are taken as exact.

    Raises:
        InputError: Pixels have no place on the target, or are not those of the station's pose.
    """
    camera = stations.camera
    if camera is None or camera.covariance is None or not has_pixels(stations, chain):
        return chain
    data = pixel_data(stations)
    return replace(chain, by_intrinsics=data.information(data.rows(chain)).by_shared)


def pixel_data(stations: Stations) -> PixelData:
    """Collect the pixels of all stations with a target pose.

    Args:
        stations: A document for which `has_pixels` is true.

    Raises:
        InputError: Pixels have no place on the target, or are not those of the station's pose.
    """
    assert stations.target is not None
    assert stations.camera is not None
    points = targets.build(stations.target).points()
    usable = [
        station if station.camera_T_target else replace(station, observation=None)
        for station in stations.stations
    ]
    camera, views = stations.camera, views_of(usable, points)
    seen = [usable[index] for index in views.index]
    poses = np.array([each.camera_T_target.matrix for each in seen if each.camera_T_target])
    squares = pnp.squared_residuals(poses, views.seen, camera.lens)
    sigma = _pixel_noise(seen, views, squares)
    _check_pixels(seen, views, squares, sigma)
    return PixelData(
        views=views,
        poses=poses,
        sigma=sigma,
        camera=camera,
        directions=_directions(camera),
        calibrated=any(finding.code == CALIBRATED for finding in stations.findings),
    )


def _directions(camera: Camera) -> FloatArray:
    if camera.covariance is None:
        return np.zeros((camera.parameters.size, 0))
    return joint_bundle.uncertain_directions(camera.covariance)


def _pixel_noise(seen: list[Station], views: Views, squares: FloatArray) -> FloatArray:
    """Return each view's pixel noise; it is pooled from the residuals where none is known."""
    pooled = float(np.sqrt(np.sum(squares) / max(views.degrees_of_freedom(), 1)))
    known = [each.observation.sigma_px for each in seen if each.observation]
    sigma = np.array([pooled if each is None else each for each in known])
    return np.asarray(np.maximum(sigma, LEAST_SIGMA))


def _check_pixels(
    seen: list[Station], views: Views, squares: FloatArray, sigma: FloatArray
) -> None:
    rms = np.sqrt(squares / (2 * views.seen.mask.sum(axis=1)))
    strange = rms > np.maximum(_STRANGE_FACTOR * sigma, _STRANGE_PIXELS)
    for row in np.flatnonzero(strange):
        raise InputError(
            f"expected the pixels that the station's camera_T_target comes from, found them "
            f"{rms[row]:.2f} px away from where it puts them",
            where=f'station "{seen[row].name}"',
            hint="run 'handeye extrinsics' again, or leave ids and pixels out of the document",
        )
