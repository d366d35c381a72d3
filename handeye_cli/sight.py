"""What the camera sees of the target at the stations, and would see from elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.chain import Chain
from handeye_cli.geometry import se3, statistics
from handeye_cli.geometry.extent import middle_of
from handeye_cli.records import Camera, FloatArray, Stations

_MARGIN = 0.02
"""Part of the image's width that the target's points keep from its border."""
_THIN = 1e-6
"""Square of the width of points over that of their length, below which they are one line."""


@dataclass(frozen=True)
class Sight:
    """The target's points as the stations of a chain see them.

    Attributes:
        points: (n, 3) target points in metres.
        mask: (N, n) which of them each station saw.
        camera: The intrinsics.
        sigma: (N,) standard deviation of one coordinate at each station, pixels.
    """

    points: FloatArray
    mask: NDArray[np.bool_]
    camera: Camera
    sigma: FloatArray

    @property
    def centre(self) -> FloatArray:
        """(3,) the middle of the target in its own frame, metres."""
        return middle_of(self.points)

    def of_whole_target(self) -> Sight:
        """Return the sight of stations that all see every point, with their median noise."""
        return replace(
            self,
            mask=np.ones_like(self.mask),
            sigma=np.full_like(self.sigma, statistics.median(self.sigma)),
        )

    def covariance(self, B: FloatArray) -> FloatArray:
        """Return the (N, 6, 6) covariances that the pixels' noise gives to (N, 4, 4) poses."""
        from handeye_cli.geometry import pnp

        nothing = np.zeros((*self.mask.shape, 2))
        seen = pnp.Sightings(self.points, nothing, self.mask)
        information = pnp.pose_information(B, seen, self.camera.lens)
        return np.asarray(self.sigma[:, None, None] ** 2 * np.linalg.inv(information))

    def in_view(self, B: FloatArray) -> NDArray[np.bool_]:
        """Return whether each station would still have its points in the image.

        Args:
            B: (..., N, 4, 4) camera_T_target.

        Returns:
            (..., N) True where all points are in front of the camera and inside a margin.
        """
        from handeye_cli.geometry.camera import project

        here = se3.transform_points(B, self.points)
        pixels = project(here, self.camera.parameters, self.camera.model)
        margin = _MARGIN * self.camera.width
        size = np.array([self.camera.width, self.camera.height]) - 1.0
        inside = np.all((pixels >= margin) & (pixels <= size - margin), axis=-1)
        return np.asarray(np.all(inside & (here[..., 2] > 0.0) | ~self.mask, axis=-1))


def sight_of(stations: Stations, chain: Chain) -> Sight | None:
    """Return what the stations of a chain saw, or None where it is not known of all of them."""
    used = [stations.stations[index] for index in chain.index]
    seen = [station.observation for station in used]
    sigma = [each.sigma_px for each in seen if each is not None and each.sigma_px is not None]
    if stations.target is None or stations.camera is None or len(sigma) < len(used):
        return None
    from handeye_cli import targets
    from handeye_cli.views import views_of

    points = targets.build(stations.target).points()
    if max(max(each.ids, default=-1) for each in seen if each is not None) >= len(points):
        return None
    views = views_of(used, points)
    if len(views.index) < len(used) or not np.all(_fix_a_pose(points, views.seen.mask)):
        return None
    return Sight(points, views.seen.mask, stations.camera, np.array(sigma))


def _fix_a_pose(points: FloatArray, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether the points of each (N, n) row do not all lie on one line."""
    weight = mask / mask.sum(axis=1, keepdims=True)
    away = points - (weight @ points)[:, None]
    spread = np.linalg.eigvalsh(np.einsum("vn,vni,vnj->vij", weight, away, away))
    return np.asarray(spread[:, 1] > _THIN * spread[:, 2])
