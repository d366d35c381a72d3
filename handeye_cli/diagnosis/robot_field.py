"""What a systematic error of the robot does to the answer, and to what is promised of it.

The error is taken as a field, smooth over the poses of the robot, whose size and length are those
that explain the residuals best. It moves the answer by its influence, all of it: also by the part
that the answer has taken up, and that no residual shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.diagnosis.answered_stations import PARTS, AnsweredStations, carried
from handeye_cli.geometry import se3, smooth_fields
from handeye_cli.geometry.bounded_variances import bounded_variances
from handeye_cli.predict import solution_covariance
from handeye_cli.records import FloatArray

LENGTHS = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8)
"""Lengths of fields that are compared, in units of the spread of the poses."""
_LEAST = 1e-4
"""Smallest variance of a level that is considered, relative to the noise as estimated."""


def widening(
    stations: AnsweredStations, form: FloatArray, moves: FloatArray
) -> tuple[float, float]:
    """Return the factors for rotation and translation that errors as seen make necessary.

    Args:
        stations: All stations of the answer.
        form: (N, 6, k) perturbations of the robot poses whose form is known; k may be 0.
        moves: (12,) how far they moved X and Z.
    """
    beside = stations.by_robot @ form
    few = replace(stations, fitted=np.concatenate([stations.fitted, beside], axis=-1)).few()
    field = _likeliest(few)
    estimate = stations.estimate
    covariance = estimate.model.covariance.copy()
    covariance[:, :6, :6] = carried(stations.to_mount, np.diag(np.repeat(field.noise, 3)))
    honest = solution_covariance(estimate.influence, covariance) + estimate.shared
    honest = honest + np.outer(moves, moves)
    # The few stand for all: each for as many as lie around it.
    influence = len(stations.robot) / len(few.robot) * few.influence
    for part, level in zip(PARTS.values(), field.field, strict=True):
        moved = np.moveaxis(influence[..., part], -1, 0)
        joint = np.einsum("dia,ij,djb->ab", moved, field.correlations, moved, optimize=True)
        honest = honest + level * joint
    ratios = se3.by_kind(np.diag(honest)[:6]) / se3.by_kind(np.diag(estimate.covariance)[:6])
    translation, rotation = np.sqrt(np.maximum(ratios, 1.0)).tolist()
    return rotation, translation


@dataclass(frozen=True)
class _Field:
    """A field of one length, and independent noise beside it, that explain the residuals best.

    Attributes:
        likelihood: How well they do, as a logarithm.
        correlations: (N, N) of the field.
        variances: (4,) of one axis: translation and rotation of the field, then of the noise.
    """

    likelihood: float
    correlations: FloatArray
    variances: FloatArray

    @property
    def field(self) -> FloatArray:
        """(2,) variances of one axis of the field's translation and rotation."""
        return self.variances[:2]

    @property
    def noise(self) -> FloatArray:
        """(2,) the same of the noise."""
        return self.variances[2:]


def _likeliest(stations: AnsweredStations) -> _Field:
    """Return the field of the length up to which the likelihood grows."""
    best = _field(stations, LENGTHS[0])
    for length in LENGTHS[1:]:
        longer = _field(stations, length, best.variances)
        if longer.likelihood < best.likelihood:
            break
        best = longer
    return best


def _field(stations: AnsweredStations, length: float, start: FloatArray | None = None) -> _Field:
    white = stations.white()
    correlations = smooth_fields.correlation(stations.robot, length)
    alone = np.eye(len(correlations))
    shapes = np.array(
        [
            smooth_fields.field_covariance(white.by_robot, between, part)
            for between in (correlations, alone)
            for part in PARTS.values()
        ]
    )
    known, free = _camera_part(stations), white.free
    sizes = np.array([len(known) / np.trace(shape) for shape in shapes])
    variances = bounded_variances(
        residuals=free.T @ white.values.ravel(),
        known=free.T @ known @ free,
        shapes=free.T @ shapes @ free,
        start=0.25 * sizes if start is None else np.maximum(start, 0.01 * sizes),
        floor=_LEAST * sizes,
    )
    covariance = known + np.tensordot(variances, shapes, axes=1)
    likelihood = smooth_fields.restricted_log_likelihood(
        white.values.ravel(), white.basis, covariance
    )
    return _Field(likelihood, correlations, variances)


def _camera_part(stations: AnsweredStations) -> FloatArray:
    """Return the (6 N, 6 N) part of the whitened residuals' covariance that is the camera's."""
    unroot = np.linalg.inv(np.linalg.cholesky(stations.spread))
    return smooth_fields.block_diagonal(carried(unroot, stations.from_camera))
