"""What times of images that are off make of the robot poses of stations seen in motion.

A pose that is read too late is off by the robot's velocity times the time. What is not known of the
time that images and poses are apart moves all stations together, `Station.shared_error`; the
scatter of the single images' times moves each by itself, and is a part of `robot_covariance`. At a
pause there is neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.answered_stations import carried
from handeye_cli.records import FloatArray

_ROUNDING = 1e-6
"""Part of a covariance that is left beside what it is but for rounding."""


class LatePoses(NamedTuple):
    """Errors of the perturbations of N poses A_i.

    Attributes:
        scatter: (N, 6, 6) covariance by the time of each image, independent of the others.
        together: (N, 6, k) by an error of the time that they share, one standard deviation of it;
            k is 0 or 1.
    """

    scatter: FloatArray
    together: FloatArray


def late_poses(chain: Chain) -> LatePoses:
    """Return what the times of its images add to the robot poses of a chain.

    A covariance that a document has for its robot poses may be of any cause. That of a time has the
    direction of the velocity, as the error that all stations share has, and no other.
    """
    nothing = np.zeros((len(chain.A), 6, 6))
    if chain.robot_covariance is None or chain.shared_error is None:
        return LatePoses(nothing, chain.by_shared_error)
    known, way = chain.robot_covariance, chain.shared_error
    square = np.maximum(np.sum(way**2, axis=-1), np.finfo(float).tiny)
    size = np.einsum("ni,nij,nj->n", way, known, way) / square / square
    along = size[:, None, None] * way[:, :, None] * way[:, None, :]
    left, whole = (np.linalg.norm(each, axis=(1, 2)) for each in (known - along, known))
    scatter = np.where((left <= _ROUNDING * whole)[:, None, None], along, nothing)
    return LatePoses(carried(chain.by_robot, scatter), chain.by_shared_error)
