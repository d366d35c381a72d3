"""The paper's simulation, section IV-A: many noisy calibrations of one layout, errors counted.

Each trial has an answer of its own, a rotation R_cg and a direction of T_cg, for the error depends
on where the camera sits around the gripper. So all numbers are averages over that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.conventions import Setup
from handeye_cli.errors import ConvergenceError
from handeye_cli.geometry import error_formulas, rotations, se3
from handeye_cli.geometry.error_formulas import FormulaFactors, StationNoise
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_inverse
from handeye_cli.records import FloatArray, PaperPrediction
from handeye_cli.records.simulation import (
    ErrorBound,
    SimulatedErrors,
    Simulation,
    SimulationSetting,
)
from handeye_cli.simulate.poses import perturbed
from handeye_cli.simulate.setting import Layout, check, layout_of, station_noise
from handeye_cli.solvers import Problem
from handeye_cli.solvers.maximum_likelihood import loop_covariance
from handeye_cli.solvers.motions import interstation_motions

_AT_ONCE = 20_000
"""Stations, or pairs of stations, of all trials that are computed at once."""
_REACH = 0.6
"""Metres from the robot's base to the target; to methods that use motions it does not matter."""
_FLOOR = 1e-9
"""Smallest level, radians and metres, that weights and bound count with: they divide by it."""


@dataclass(frozen=True)
class Draw:
    """Trials of a layout: what is true, and what was measured.

    Attributes:
        X: (trials, 4, 4) true gripper_T_camera.
        Z: (trials, 4, 4) true base_T_target.
        A: (trials, N, 4, 4) true base_T_gripper.
        base_T_gripper: (trials, N, 4, 4) as measured.
        camera_T_target: (trials, N, 4, 4) as measured.
    """

    X: FloatArray
    Z: FloatArray
    A: FloatArray
    base_T_gripper: FloatArray
    camera_T_target: FloatArray


def simulate(setting: SimulationSetting, trials: int, seed: int) -> Simulation:
    """Calibrate in one setting again and again.

    Args:
        setting: What is simulated.
        trials: How often, up to 100000.
        seed: Of all chance; the same seed gives the same numbers.

    Raises:
        UsageError: A number is out of its range, or a method or a choice of pairs unknown.
        ConvergenceError: The method did not settle in every trial.
    """
    check(setting, trials, seed)
    errors = run_trials(layout_of(setting), setting, trials, np.random.default_rng(seed))
    return Simulation(Setup.EYE_IN_HAND, setting, trials, seed, errors)


def run_trials(
    layout: Layout, setting: SimulationSetting, trials: int, rng: np.random.Generator
) -> SimulatedErrors:
    """Calibrate with one layout again and again, and count the errors.

    Args:
        layout: The stations; they take the place of the setting's own.
        setting: Lever, noise and method.
        trials: How often.
        rng: Source of all chance.

    Raises:
        ConvergenceError: The method did not settle in every trial.
    """
    block = max(1, _AT_ONCE // max(len(layout.target_T_camera), len(layout.pairs)))
    errors, bounds = [], []
    for first in range(0, trials, block):
        drawn = draw(layout, setting, min(block, trials - first), rng)
        errors.append(errors_of(drawn, layout, setting))
        bounds.append(cramer_rao_bounds(drawn, layout, setting))
    rotation, translation = np.concatenate(errors).T
    least_rotation, least_translation = np.concatenate(bounds).T
    return SimulatedErrors(
        rotation_rms=_rms(rotation),
        rotation_max=float(np.max(rotation)),
        translation_rms=_rms(translation),
        translation_max=float(np.max(translation)),
        predicted=paper_prediction(layout, setting),
        bound=ErrorBound(_rms(least_rotation), _rms(least_translation)),
    )


def draw(layout: Layout, setting: SimulationSetting, trials: int, rng: np.random.Generator) -> Draw:
    """Draw answers, and what robot and camera then measure.

    Args:
        layout: The stations.
        setting: Lever and noise.
        trials: How many.
        rng: Source of all chance.
    """
    X, Z = _anywhere(setting.lever, trials, rng), _anywhere(_REACH, trials, rng)
    A = Z[:, None] @ layout.target_T_camera @ se3.inverse(X)[:, None]
    B, noise = se3.inverse(layout.target_T_camera), setting.noise
    robot = perturbed(A, noise.robot_rotation, noise.robot_translation, rng)
    camera = perturbed(B, noise.camera_rotation, noise.camera_translation, rng, (trials,))
    return Draw(X, Z, A, robot, camera)


def errors_of(drawn: Draw, layout: Layout, setting: SimulationSetting) -> FloatArray:
    """Return the (trials, 2) rotation and translation errors of a method, radians and metres.

    Args:
        drawn: The trials.
        layout: Their stations.
        setting: Noise and method.

    Raises:
        UsageError: Unknown method.
        ConvergenceError: The method did not settle in every trial.
    """
    covariance = _covariance(station_noise(setting.noise), len(layout.target_T_camera))
    problem = Problem(drawn.base_T_gripper, drawn.camera_T_target, layout.pairs, covariance)
    apart = se3.difference(_answers(problem, setting.method), drawn.X)
    return np.asarray(np.linalg.norm(apart.reshape(-1, 2, 3)[:, ::-1], axis=-1))


def _answers(problem: Problem, method: str) -> FloatArray:
    """Return the (trials, 4, 4) answers of a method."""
    solver = solvers.load(method)
    try:
        with np.errstate(all="ignore"):  # a trial that runs away is told of in one sentence
            solution = solver.solve(problem)
    except np.linalg.LinAlgError as error:
        raise _unsettled(method, len(problem.A)) from error
    if not solution.converged:
        raise _unsettled(method, len(problem.A))
    return solution.X


def _unsettled(method: str, trials: int) -> ConvergenceError:
    return ConvergenceError(
        f"{method} did not settle in all of {trials} simulated calibrations",
        hint="lessen the noise, tilt the stations more, or take --method tsai-lenz",
    )


def cramer_rao_bounds(drawn: Draw, layout: Layout, setting: SimulationSetting) -> FloatArray:
    """Return the (trials, 2) least RMS errors of rotation and translation, radians and metres.

    They are those of the first-order model at the truth, one for each trial's own answer.

    Args:
        drawn: The trials; what was measured is not looked at.
        layout: Their stations.
        setting: The noise.
    """
    B = se3.inverse(layout.target_T_camera)
    loop = loop_jacobians(drawn.A, B, drawn.X, drawn.Z)
    covariance = _covariance(station_noise(setting.noise), len(B))
    weight = np.linalg.inv(loop_covariance(Problem(drawn.A, B, layout.pairs, covariance), loop))
    J = loop.by_unknowns
    information = np.sum(np.swapaxes(J, -1, -2) @ weight @ J, axis=-3)
    variance = np.einsum("...ii->...i", scaled_inverse(information))
    return np.asarray(np.sqrt(se3.by_kind(variance[:, :6]))[:, ::-1])


def paper_prediction(layout: Layout, setting: SimulationSetting) -> PaperPrediction:
    """Return what eq. (29)-(33) predict, as an RMS over all directions of T_cg.

    Args:
        layout: The stations.
        setting: Lever and noise.
    """
    factors, noise = critical_factors(layout, setting.lever), station_noise(setting.noise)
    return PaperPrediction(
        rotation=error_formulas.rotation_sigma(factors, noise),
        translation=error_formulas.translation_sigma(factors, noise),
        rotation_max=error_formulas.rotation_max(factors, noise),
        translation_max=error_formulas.translation_max(factors, noise),
    )


def critical_factors(layout: Layout, lever: float) -> FormulaFactors:
    """Return what the error depends on, section III-B of the paper.

    Only the gripper's way between stations depends on the direction of T_cg. With the turns R_i of
    the camera its mean square is `|p_i - p_j|^2 + |T_cg|^2 |R_i - R_j|^2 / 3`.

    Args:
        layout: The stations.
        lever: |T_cg|, metres.
    """
    cameras, pairs = layout.target_T_camera, layout.pairs
    B = se3.inverse(cameras)
    _, motion_c = interstation_motions(cameras, B, pairs)
    apart = cameras[pairs[:, 0]] - cameras[pairs[:, 1]]
    squares = np.sum(apart[:, :3, 3] ** 2, axis=-1)
    squares += lever**2 / 3.0 * np.sum(apart[:, :3, :3] ** 2, axis=(-2, -1))
    factors = error_formulas.critical_factors(cameras, B, motion_c, pairs)
    return replace(factors, robot_distance=float(np.sqrt(np.mean(squares))))


def _anywhere(distance: float, count: int, rng: np.random.Generator) -> FloatArray:
    """Return (count, 4, 4) poses, turned in any way and moved by a distance in any direction."""
    R = rotations.matrix_from_quaternion(rng.standard_normal((count, 4)))
    direction = rng.standard_normal((count, 3))
    return se3.from_parts(R, distance * direction / np.linalg.norm(direction, axis=1)[:, None])


def _covariance(noise: StationNoise, count: int) -> FloatArray:
    """Return the (N, 12, 12) covariance of the poses of robot and camera."""
    levels = np.maximum(
        [
            [noise.robot_rotation, noise.robot_translation],
            [noise.camera_rotation, noise.camera_translation],
        ],
        _FLOOR,
    )
    joint = np.zeros((12, 12))
    joint[:6, :6], joint[6:, 6:] = (isotropic_covariance(*each) for each in levels.tolist())
    return np.broadcast_to(joint, (count, 12, 12))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
