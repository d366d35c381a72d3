"""Simulated stations with known truth, for the tests of solvers and stages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.estimates import Estimate
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.star import star_pairs
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.predict import noise_freedom, predicted_error
from handeye_cli.records import (
    Calibration,
    FloatArray,
    Noise,
    Station,
    Stations,
    UncertainPose,
)
from handeye_cli.solvers import Problem

PAPER_DISTANCE = 6.65 * 0.0254
PAPER_LEVER = 9.5 * 0.0254


@dataclass(frozen=True)
class Scene:
    """Perfect stations of the paper's layout with a random answer."""

    A: FloatArray
    B: FloatArray
    X: FloatArray
    Z: FloatArray


def unit(rng: np.random.Generator) -> FloatArray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def scene(
    rng: np.random.Generator, count: int, *, angle: float | None = None, tilt_deg: float = 30.0
) -> Scene:
    """`angle` is that of the answer's rotation; random when not given."""
    B = se3.inverse(generate_stations(count, PAPER_DISTANCE, np.radians(tilt_deg)))
    angle = rng.uniform(0.0, np.pi) if angle is None else angle
    X = se3.from_parts(rotations.exp(angle * unit(rng)), PAPER_LEVER * unit(rng))
    Z = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.6 * unit(rng))
    return Scene(Z @ se3.inverse(B) @ se3.inverse(X), B, X, Z)


def general_scene(rng: np.random.Generator, count: int) -> Scene:
    """Rotations about axes in all directions, target distances between 0.3 and 0.6 m."""
    direction = rotations.exp(0.5 * rng.normal(size=(count, 3)))
    away = np.concatenate(
        [0.05 * rng.normal(size=(count, 2)), rng.uniform(0.3, 0.6, (count, 1))], axis=1
    )
    base = scene(rng, 3)
    B = se3.from_parts(direction, away)
    return Scene(base.Z @ se3.inverse(B) @ se3.inverse(base.X), B, base.X, base.Z)


def joint_covariance(count: int, noise: Noise) -> FloatArray:
    joint = np.zeros((count, 12, 12))
    joint[:, :6, :6] = isotropic_covariance(noise.robot_rotation, noise.robot_translation)
    joint[:, 6:, 6:] = isotropic_covariance(noise.camera_rotation, noise.camera_translation)
    return joint


def problem(perfect: Scene, noise: Noise, *, pairs: FloatArray | None = None) -> Problem:
    count = len(perfect.A)
    chosen = star_pairs(count) if pairs is None else pairs
    return Problem(perfect.A, perfect.B, chosen, joint_covariance(count, noise))


def disturbed(
    rng: np.random.Generator, poses: FloatArray, covariance: FloatArray, trials: int | None = None
) -> FloatArray:
    """Poses (N, 4, 4) with noise of (N, 6, 6) covariances, `trials` times when given."""
    shape = (len(poses), 6) if trials is None else (trials, len(poses), 6)
    root = np.linalg.cholesky(covariance)
    return se3.perturb(poses, np.einsum("nij,...nj->...ni", root, rng.normal(size=shape)))


def stations(
    rng: np.random.Generator,
    perfect: Scene,
    noise: Noise,
    *,
    setup: Setup = Setup.EYE_IN_HAND,
    given: bool = False,
    with_covariance: bool = True,
) -> Stations:
    """A noisy stations document of a scene; the noise is put on base_T_gripper in either setup."""
    joint = joint_covariance(len(perfect.A), noise)
    robot = perfect.A if setup is Setup.EYE_IN_HAND else se3.inverse(perfect.A)
    robot = disturbed(rng, robot, joint[:, :6, :6])
    camera = disturbed(rng, perfect.B, joint[:, 6:, 6:])
    rows = [
        Station(
            name=f"{i:02d}",
            base_T_gripper=robot[i],
            camera_T_target=UncertainPose(camera[i], joint[i, 6:, 6:] if with_covariance else None),
        )
        for i in range(len(robot))
    ]
    return Stations(setup, tuple(rows), noise=noise if given else None)


def estimated(document: Stations, method: str = solvers.DEFAULT, pairs: str = "star") -> Estimate:
    """The estimate that an answer of `solve` rests on, without judging the data first."""
    chain = chain_of(document)
    return best_estimate(chain, choose_pairs(pairs, len(chain.A)), document, method)


def calibrated(document: Stations, method: str = solvers.DEFAULT) -> Calibration:
    """The answer of `solve` on good data without what it says of them, which takes most time."""
    found, chain = estimated(document, method), chain_of(document)
    model, covariance = found.model, found.covariance
    free = noise_freedom(chain, found.solution, model) if len(model.shapes) else None
    return Calibration(
        setup=document.setup,
        method=method,
        mount_T_camera=UncertainPose(found.solution.X, covariance[:6, :6]),
        reference_T_target=UncertainPose(found.solution.Z, covariance[6:, 6:]),
        predicted_error=predicted_error(found.influence, model, None, found.shared),
        noise=model.noise,
        noise_estimated=len(model.shapes) > 0,
        stations=(),
        pairs=(),
        covariance_between=covariance[:6, 6:],
        noise_freedom=free,
    )
