"""The noise of stations whose answer is determined in part only.

What the data leave free explains nothing; so only the determined unknowns are taken off the degrees
of freedom that the residuals have.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import se3, statistics, variance
from handeye_cli.geometry.free_directions import Freedom
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.noise_levels import Loops, NoiseModel, noise_of_loops
from handeye_cli.records import FloatArray, Noise
from handeye_cli.solvers.problem import Solution

_FLOOR = 1e-9
"""Smallest noise considered, radians and metres."""
_SURE = 2.0
"""Standard deviations of an estimated variance that are added where noise must not be missed."""
_FEW = 2
"""Stations whose residuals, two in number, cannot tell rotation noise from translation noise."""


def rough_covariance(chain: Chain, solution: Solution, least: tuple[int, int]) -> FloatArray:
    """Return (N, 12, 12) covariances of noise that explains the residuals of a rough solution.

    What the unknowns, twelve without those that are surely free, have taken out is put back.
    Robot and camera get the same.

    Args:
        chain: N stations.
        solution: A rough one.
        least: Rotations and translations that are surely free.
    """
    residuals = loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals
    squares = se3.by_kind(np.mean(residuals**2, axis=0))
    squares = squares * residuals.size / max(residuals.size - 12 + sum(least), 1)
    translation, rotation = np.maximum(np.sqrt(squares), _FLOOR).tolist()
    half = isotropic_covariance(rotation, translation) / 2.0
    return np.tile(np.kron(np.eye(2), half), (len(chain.A), 1, 1))


def largest_covariance(chain: Chain, model: NoiseModel) -> FloatArray:
    """Return the (N, 12, 12) covariances of noise as large as its estimate allows.

    A few residuals may be small by chance, and would make noise look like motion. Noise that is put
    down to the robot for want of knowledge may as well be the camera's: both get half of it.

    Args:
        chain: N stations.
        model: Their noise.
    """
    known = np.diag(model.information)
    # rounding makes the information on a level at its floor negative; it adds nothing then
    sigma = np.where(known > 0.0, 1.0 / np.sqrt(np.maximum(known, 1e-300)), 0.0)
    largest = model.covariance + _SURE * np.tensordot(sigma, model.shapes, axes=1)
    if not np.any(largest[:, 6:, 6:]):
        back = np.linalg.inv(chain.by_robot)
        half = largest[:, :6, :6] / 2.0
        largest[:, 6:, 6:] = back @ half @ np.swapaxes(back, -1, -2)
        largest[:, :6, :6] = half
    return np.asarray(largest)


def held_noise(
    chain: Chain,
    given: Noise | None,
    solution: Solution,
    free: Freedom,
    start: Noise | None = None,
) -> NoiseModel:
    """Return the noise of the stations' poses, by the residuals that determined unknowns leave.

    Args:
        chain: The stations.
        given: Levels that are taken as given.
        solution: A solution to take the residuals at.
        free: What is not among the unknowns.
        start: Levels to start the estimation from.

    Raises:
        UndeterminedError: So few stations that no residual is left.
    """
    loops, given = _loops(chain, solution, free), given or Noise()
    if given.robot_rotation is None or given.robot_translation is None:
        unknowns = free.basis.shape[1]
        if loops.residuals.size <= unknowns:
            raise UndeterminedError(
                "expected residuals to estimate the noise from, found none: "
                f"{loops.residuals.size} equations for {unknowns} unknowns",
                hint="give the noise levels under 'noise' in the document, or add stations",
            )
        if len(chain.A) <= _FEW and given.robot_rotation == given.robot_translation:
            return _one_level(chain, given, loops)
    return noise_of_loops(chain, given, loops, start)


def _loops(chain: Chain, solution: Solution, free: Freedom) -> Loops:
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    by_unknowns, by_causes = loop.by_unknowns @ free.basis, chain.by_shared_causes(loop)
    unknowns, shared = by_unknowns.shape[-1], by_causes.shape[-1]
    return Loops(
        residuals=loop.residuals,
        design=np.concatenate([by_unknowns, by_causes], axis=-1),
        by_poses=loop.by_poses,
        other_residuals=np.zeros(shared),
        other_design=np.eye(shared, unknowns + shared, unknowns),
    )


def _one_level(chain: Chain, given: Noise, loops: Loops) -> NoiseModel:
    """Return the noise of two stations, that of the robot being one level.

    A radian of the robot's noise counts like the camera's distance from the target: a choice, as
    two residuals allow no estimate of the ratio.
    """
    length = max(statistics.median(np.linalg.norm(chain.B[:, :3, 3], axis=1)), _FLOOR)
    unknown = 0.0 if not chain.has_covariance else None
    nothing = replace(
        given,
        robot_rotation=0.0,
        robot_translation=0.0,
        camera_rotation=unknown if given.camera_rotation is None else given.camera_rotation,
        camera_translation=unknown
        if given.camera_translation is None
        else given.camera_translation,
    )
    known = noise_of_loops(chain, nothing, loops)
    by_poses, by_poses_t = loops.by_poses, np.swapaxes(loops.by_poses, -1, -2)
    shape = np.zeros_like(known.covariance)
    unit = isotropic_covariance(1.0, length)
    shape[:, :6, :6] = chain.by_robot @ unit @ np.swapaxes(chain.by_robot, -1, -2)
    found = variance.estimate(
        residuals=loops.residuals,
        design=loops.design,
        known=by_poses @ known.covariance @ by_poses_t,
        shapes=(by_poses @ shape @ by_poses_t)[None],
        start=np.mean(loops.residuals**2, keepdims=True).reshape(1),
        floor=np.array([_FLOOR**2]),
    )
    level = float(np.sqrt(found.variances[0]))
    return NoiseModel(
        replace(
            known.noise,
            robot_rotation=level,
            robot_translation=level * length,
            camera_rotation=known.noise.camera_rotation or None,
            camera_translation=known.noise.camera_translation or None,
        ),
        known.covariance + found.variances[0] * shape,
        found.variances,
        shape[None],
        found.information,
    )
