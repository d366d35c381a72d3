"""What a camera with uncertain intrinsics sees of the target, from wherever it looks.

An error of the intrinsics moves the target's poses at all stations, those to come as those that
were recorded. What the pixels of a view say beyond their own pose speaks of the intrinsics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry import joint_bundle, pnp
from handeye_cli.records import Camera, FloatArray


@dataclass(frozen=True)
class UncertainSight:
    """A whole target in front of a camera whose intrinsics are uncertain.

    Attributes:
        points: (n, 3) target points in metres.
        camera: The intrinsics.
        directions: (4 + k, m) how they move with m errors of unit variance.
        sigma: Standard deviation of one coordinate, pixels.
    """

    points: FloatArray
    camera: Camera
    directions: FloatArray
    sigma: float

    def covariance(self, B: FloatArray) -> FloatArray:
        """Return the (K, 6, 6) covariances that the pixels' noise gives to (K, 4, 4) poses."""
        return self.view(B).covariance

    def view(self, B: FloatArray) -> joint_bundle.ViewInformation:
        """Return what views from (K, 4, 4) camera_T_target would tell of poses and intrinsics."""
        pixels = np.zeros((len(B), len(self.points), 2))
        everything = np.ones(pixels.shape[:2], dtype=bool)
        seen = pnp.Sightings(self.points, pixels, everything)
        sigma = np.full(len(B), self.sigma)
        return joint_bundle.view_information(B, seen, sigma, self.camera.lens, self.directions)
