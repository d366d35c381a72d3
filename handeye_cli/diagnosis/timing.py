"""Whether the residuals grow with the speed at which the robot went through its stations.

A pose that was read at another time than its image was taken is off by the time times the speed.
The directions of the motions are not known here: a time gives errors of known size in any
direction, which are a third level of noise beside those of the robot's rotation and translation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.answered_stations import carried
from handeye_cli.geometry import smooth_fields, variance
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.records import Finding, FloatArray, IntArray
from handeye_cli.solvers.problem import Solution

_SIGNIFICANCE = 1e-3
"""Chance that residuals that do not depend on the speed are blamed on it."""
_FEWEST = 8
"""Stations below which nothing is said."""
_MOST = 40
"""Stations, of all speeds, that are tested."""
_LEAST = 1e-6
"""Smallest variance that is considered, relative to that of all residuals."""
_MILLISECOND = 1e-3


@dataclass(frozen=True)
class TimeOffset:
    """A time between robot poses and images.

    Attributes:
        finding: The verdict.
        robot_rotation: What is left of the robot's rotation noise, RMS, radians.
        robot_translation: The same of its translation noise, metres.
        covariance: (N, 6, 6) of the perturbations of base_T_gripper that the time gives.
    """

    finding: Finding
    robot_rotation: float
    robot_translation: float
    covariance: FloatArray


def time_offset(
    chain: Chain, solution: Solution, covariance: FloatArray, speeds: FloatArray
) -> TimeOffset | None:
    """Return the time between poses and images, where the residuals grow with the speed, else None.

    Args:
        chain: The N stations.
        solution: The answer.
        covariance: (N, 12, 12) of the stations' poses, as if there were no such time.
        speeds: (N, 2) of the gripper in the base, m/s and rad/s.
    """
    if len(chain.A) < _FEWEST or not np.any(speeds):
        return None
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    by_robot = loop.by_robot @ chain.by_robot
    design = np.concatenate([loop.by_unknowns, loop.by_camera @ chain.by_intrinsics], axis=-1)
    known = carried(loop.by_camera, covariance[:, 6:, 6:])
    spread = known + carried(loop.by_robot, covariance[:, :6, :6])
    per_second = np.repeat(speeds**2 / 3.0, 3, axis=1)[:, :, None] * np.eye(6)
    rows = _of_all_speeds(speeds)
    white = smooth_fields.whitened(loop.residuals[rows], spread[rows], design[rows], by_robot[rows])
    fast = carried(white.by_robot, per_second[rows])
    chance = white.likeness(smooth_fields.block_diagonal(fast))
    if chance > _SIGNIFICANCE:
        return None
    units = (isotropic_covariance(1.0, 0.0), isotropic_covariance(0.0, 1.0), per_second)
    shapes = np.array([carried(by_robot, unit) for unit in units])
    sizes = np.einsum("nii->", spread) / np.einsum("knii->k", shapes)
    found = variance.estimate(
        residuals=loop.residuals,
        design=design,
        known=known,
        shapes=shapes,
        start=sizes / 3.0,
        floor=_LEAST * sizes,
    )
    return _measured(found, per_second, chance)


def _measured(
    found: variance.VarianceComponents, per_second: FloatArray, chance: float
) -> TimeOffset:
    rotation, translation, seconds = np.sqrt(found.variances).tolist()
    sigma = math.sqrt(float(np.linalg.pinv(found.information)[2, 2])) / (2.0 * seconds)
    finding = _finding(seconds, sigma, chance)
    return TimeOffset(finding, rotation, translation, found.variances[2] * per_second)


def _of_all_speeds(speeds: FloatArray) -> IntArray:
    """Return rows from the slowest station to the fastest, at most as many as are tested."""
    scale = np.maximum(np.sqrt(np.mean(speeds**2, axis=0)), np.finfo(float).tiny)
    order = np.argsort(np.linalg.norm(speeds / scale, axis=1), kind="stable")
    count = min(len(order), _MOST)
    return np.asarray(order[np.unique(np.linspace(0, len(order) - 1, count).round().astype(int))])


def _finding(seconds: float, sigma: float, chance: float) -> Finding:
    time, doubt = seconds / _MILLISECOND, sigma / _MILLISECOND
    return Finding(
        "time-offset",
        "warning",
        f"residuals grow with the robot's speed (p = {chance:.1g}): poses and images are about "
        f"{time:.1f} ms (+- {doubt:.1f}) apart",
        f"stop the robot at every station, or try --time-offset {time:.0f}ms and "
        f"--time-offset -{time:.0f}ms",
    )
