"""The noise of robot and camera poses: taken as given, or estimated from the loop's residuals.

The camera's poses usually bring their covariance along. What is then left of the residuals is the
robot's. Where nothing is known of the camera, residuals cannot tell the two apart and all is put
down to the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.geometry import variance
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.records import FloatArray, Noise
from handeye_cli.solvers.problem import Solution

_FLOOR = 1e-9
"""Smallest level considered, radians and metres."""
_ROBOT = ("robot_rotation", "robot_translation")
_CAMERA = ("camera_rotation", "camera_translation")


@dataclass(frozen=True)
class NoiseModel:
    """Covariances of all stations' poses, and how sure the estimated part is.

    Attributes:
        noise: The levels as RMS magnitudes.
        covariance: (N, 12, 12) of the perturbations of A_i and B_i together.
        variances: (K,) the estimated ones; K is 0 where all is given.
        shapes: (K, N, 12, 12) derivative of the covariance by each of them.
        information: (K, K) on the estimated variances.
        converged: Whether the estimation settled.
    """

    noise: Noise
    covariance: FloatArray
    variances: FloatArray
    shapes: FloatArray
    information: FloatArray
    converged: bool = True


def noise_model(
    chain: Chain, given: Noise | None, solution: Solution, start: Noise | None = None
) -> NoiseModel:
    """Return the noise of the stations' poses.

    Args:
        chain: The stations.
        given: Levels that are taken as given; those of the robot are estimated otherwise, and those
            of the camera where the robot's are given and the stations have no covariances.
        solution: A solution to take the residuals at.
        start: Levels to start the estimation from; the size of the residuals when not given.
    """
    given = given or Noise()
    levels = {name: getattr(given, name) for name in (*_ROBOT, *_CAMERA)}
    known = np.zeros((len(chain.A), 12, 12))
    if all(levels[name] is None for name in _CAMERA):
        known[:, 6:, 6:] = chain.camera_covariance
    for name, level in levels.items():
        if level is not None:
            known = known + max(level, _FLOOR) ** 2 * _shape(chain, name)
    free = [name for name in _ROBOT if levels[name] is None]
    if not free and not chain.has_covariance:
        free = [name for name in _CAMERA if levels[name] is None]
    if not free:
        nothing = np.zeros((0, *known.shape))
        summary = _summary(given, chain, known)
        return NoiseModel(summary, known, np.zeros(0), nothing, np.zeros((0, 0)))
    begin = _size_of_residuals(chain, solution) if start is None else start
    return _estimated(chain, given, solution, known, {name: getattr(begin, name) for name in free})


def _size_of_residuals(chain: Chain, solution: Solution) -> Noise:
    residuals = loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals
    translation, rotation = np.sqrt(np.mean(residuals**2, axis=0).reshape(2, 3).sum(axis=1))
    return Noise(*2 * (float(rotation), float(translation)))


def _shape(chain: Chain, name: str) -> FloatArray:
    """Return the (N, 12, 12) covariance that one level of 1 gives to the stations' poses."""
    rotation, translation = (1.0, 0.0) if name.endswith("rotation") else (0.0, 1.0)
    unit = isotropic_covariance(rotation, translation)
    shape = np.zeros((len(chain.A), 12, 12))
    if name in _ROBOT:
        shape[:, :6, :6] = chain.by_robot @ unit @ np.swapaxes(chain.by_robot, -1, -2)
    else:
        shape[:, 6:, 6:] = unit
    return shape


def _estimated(
    chain: Chain, given: Noise, solution: Solution, known: FloatArray, free: dict[str, float]
) -> NoiseModel:
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    by_poses = np.concatenate([loop.by_robot, loop.by_camera], axis=-1)
    by_poses_t = np.swapaxes(by_poses, -1, -2)
    shapes = np.array([_shape(chain, name) for name in free])
    found = variance.estimate(
        residuals=loop.residuals,
        design=loop.by_unknowns,
        known=by_poses @ known @ by_poses_t,
        shapes=by_poses @ shapes @ by_poses_t,
        start=np.array(list(free.values())) ** 2,
        floor=np.full(len(free), _FLOOR**2),
    )
    covariance = known + np.tensordot(found.variances, shapes, axes=1)
    levels = dict(zip(free, np.sqrt(found.variances).tolist(), strict=True))
    noise = _summary(replace(given, **levels), chain, covariance)
    return NoiseModel(
        noise, covariance, found.variances, shapes, found.information, found.converged
    )


def _summary(levels: Noise, chain: Chain, covariance: FloatArray) -> Noise:
    """Return the levels with the camera's RMS filled in from the stations' covariances."""
    if levels.camera_rotation is not None or not chain.has_covariance:
        return levels
    traces = np.einsum("nii->ni", covariance[:, 6:, 6:]).mean(axis=0)
    return replace(
        levels,
        camera_rotation=float(np.sqrt(traces[3:].sum())),
        camera_translation=float(np.sqrt(traces[:3].sum())),
    )
