"""The noise of robot and camera poses: taken as given, or estimated from the loop's residuals.

The camera's poses usually bring their covariance along. What is then left of the residuals is the
robot's. Where nothing is known of the camera, residuals cannot tell the two apart and all is put
down to the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.geometry import se3, variance
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
    """

    noise: Noise
    covariance: FloatArray
    variances: FloatArray
    shapes: FloatArray
    information: FloatArray


class Loops(NamedTuple):
    """The stations' loops as linear equations in what is common to them.

    Attributes:
        residuals: (N, 6) of the stations.
        design: (N, 6, p) derivative by the common unknowns.
        by_poses: (N, 6, 12) derivative by the perturbations of A_i and B_i.
        other_residuals: (q,) of further equations in the same unknowns, of unit variance.
        other_design: (q, p) their derivative.
    """

    residuals: FloatArray
    design: FloatArray
    by_poses: FloatArray
    other_residuals: FloatArray
    other_design: FloatArray


def noise_model(
    chain: Chain, given: Noise | None, solution: Solution, start: Noise | None = None
) -> NoiseModel:
    """Return the noise of the stations' poses, by the residuals of a solution.

    Args:
        chain: The stations.
        given: Levels that are taken as given; those of the robot are estimated otherwise, and those
            of the camera where the robot's are given and the stations have no covariances.
        solution: A solution to take the residuals at.
        start: Levels to start the estimation from; the size of the residuals when not given.
    """
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    design = np.concatenate([loop.by_unknowns, chain.by_shared_causes(loop)], axis=-1)
    shared = design.shape[-1] - 12
    loops = Loops(
        residuals=loop.residuals,
        design=design,
        by_poses=loop.by_poses,
        other_residuals=np.zeros(shared),
        other_design=np.eye(shared, 12 + shared, 12),
    )
    return noise_of_loops(chain, given, loops, start)


def noise_of_loops(
    chain: Chain, given: Noise | None, loops: Loops, start: Noise | None = None
) -> NoiseModel:
    """Return the noise of the stations' poses, by loops that may share more than X and Z.

    The arguments but `loops` are those of `noise_model`.
    """
    given = given or Noise()
    levels = {name: getattr(given, name) for name in (*_ROBOT, *_CAMERA)}
    known = np.zeros((len(chain.A), 12, 12))
    known[:, 6:, 6:] = _not_given(chain.camera_covariance, given)
    if chain.robot_covariance is not None:
        turned = np.swapaxes(chain.by_robot, -1, -2)
        known[:, :6, :6] = chain.by_robot @ chain.robot_covariance @ turned
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
    begin = _size_of(loops.residuals) if start is None else start
    return _estimated(chain, given, loops, known, {name: getattr(begin, name) for name in free})


def _not_given(camera: FloatArray, given: Noise) -> FloatArray:
    """Return the (N, 6, 6) covariances of the camera's poses without the parts of given levels."""
    translation, rotation = given.camera_translation is None, given.camera_rotation is None
    kept = np.repeat([translation, rotation], 3)
    return np.asarray(camera * kept[:, None] * kept)


def _size_of(residuals: FloatArray) -> Noise:
    translation, rotation = np.sqrt(se3.by_kind(np.mean(residuals**2, axis=0))).tolist()
    return Noise(*2 * (rotation, translation))


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
    chain: Chain, given: Noise, loops: Loops, known: FloatArray, free: dict[str, float]
) -> NoiseModel:
    by_poses, by_poses_t = loops.by_poses, np.swapaxes(loops.by_poses, -1, -2)
    shapes = np.array([_shape(chain, name) for name in free])
    other = _in_blocks(loops)
    found = variance.estimate(
        residuals=np.concatenate([loops.residuals, other.residuals]),
        design=np.concatenate([loops.design, other.design]),
        known=np.concatenate([by_poses @ known @ by_poses_t, other.known]),
        shapes=np.concatenate([by_poses @ shapes @ by_poses_t, other.shapes(len(free))], axis=1),
        start=np.array(list(free.values())) ** 2,
        floor=np.full(len(free), _FLOOR**2),
    )
    covariance = known + np.tensordot(found.variances, shapes, axes=1)
    levels = dict(zip(free, np.sqrt(found.variances).tolist(), strict=True))
    noise = _summary(replace(given, **levels), chain, covariance)
    return NoiseModel(noise, covariance, found.variances, shapes, found.information)


class _Blocks(NamedTuple):
    """Further equations as blocks of the stations' size, filled up with equations of nothing."""

    residuals: FloatArray
    design: FloatArray

    @property
    def known(self) -> FloatArray:
        return np.tile(np.eye(6), (len(self.residuals), 1, 1))

    def shapes(self, count: int) -> FloatArray:
        return np.zeros((count, len(self.residuals), 6, 6))


def _in_blocks(loops: Loops) -> _Blocks:
    missing = -len(loops.other_residuals) % 6
    residuals = np.pad(loops.other_residuals, (0, missing)).reshape(-1, 6)
    design = np.pad(loops.other_design, ((0, missing), (0, 0)))
    return _Blocks(residuals, design.reshape(-1, 6, design.shape[-1]))


def _summary(levels: Noise, chain: Chain, covariance: FloatArray) -> Noise:
    """Return the levels with the camera's RMS filled in from the stations' covariances."""
    if not chain.has_covariance:
        return levels
    variances = np.einsum("nii->ni", covariance[:, 6:, 6:]).mean(axis=0)
    rms = np.sqrt(se3.by_kind(variances)).tolist()
    found = dict(zip(("camera_translation", "camera_rotation"), rms, strict=True))
    return replace(
        levels, **{name: level for name, level in found.items() if getattr(levels, name) is None}
    )
