"""Plans: the error they lead to, whether it is the predicted one, and what choosing takes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.effort import Effort, numbers
from benchmarks.processes import timed
from benchmarks.solving.layouts import INCH, NOISE
from benchmarks.tables import Column, Table
from handeye_cli import Setup, solve_batch
from handeye_cli.geometry import rotations, se3, star
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.station_generator import robot_poses
from handeye_cli.plan import plan
from handeye_cli.planning.options import PlanOptions
from handeye_cli.planning.prediction import UncertainRig, predicted_error
from handeye_cli.planning.views import cameras_of, grid
from handeye_cli.simulate.poses import noisy_stations

DISTANCE, TILT = 6.65 * INCH, np.radians(30.0)
X = se3.from_parts(rotations.exp(np.array([0.3, -0.2, 1.1])), np.array([0.1, 0.15, 0.16]))
Z = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.array([0.6, 0.1, 0.0]))
RANDOM = 500
ROLL = np.radians(75.0)
"""With turns of half a revolution a few stations may allow two answers, however small the noise."""
HEADS = (
    Column("stations", "d"),
    Column("layout"),
    Column("rotation [mrad]", ".3f"),
    Column("translation [mm]", ".3f"),
    Column("simulated / predicted, rotation", ".3f"),
    Column("translation", ".3f"),
    Column("time [s]", ".3f"),
)
NOTE = f"""Predicted RMS error with the paper's noise, distance and a tilt of at most 30 deg: of
the paper's circle, of the best of {RANDOM} random choices of views with a roll of at most 75 deg,
and of the stations that `plan --optimize` chooses. A prediction is the Cramer-Rao bound of its
layout, so maximum likelihood must reach it in simulation and nothing can be below it. OpenCV
plans nothing."""


def rig() -> UncertainRig:
    of_robot = isotropic_covariance(NOISE.robot_rotation, NOISE.robot_translation)
    of_camera = isotropic_covariance(NOISE.camera_rotation, NOISE.camera_translation)
    return UncertainRig(Setup.EYE_IN_HAND, X[None], Z[None], of_robot, of_camera)


def planned(count: int, options: PlanOptions):
    made = plan(
        count, distance=DISTANCE, tilt=TILT, mount_T_camera=X, reference_T_target=Z, options=options
    )
    return np.array([station.target_T_camera for station in made.stations])


def at_random(count: int, seed: int):
    """The best of many layouts in translation."""
    views = cameras_of(grid(TILT, ROLL, DISTANCE, DISTANCE), np.zeros(3))
    rng = np.random.default_rng([seed, count])
    layouts = [views[rng.choice(len(views), count, replace=False)] for _ in range(RANDOM)]
    return min(layouts, key=lambda cameras: error(cameras).translation)


def error(cameras):
    return predicted_error(rig(), cameras, star.star_pairs(len(cameras)))


def simulated(cameras, trials: int, seed: int):
    """RMS errors of rotation and translation of maximum likelihood."""
    A = robot_poses(cameras, X, Z, Setup.EYE_IN_HAND)
    rng = np.random.default_rng([seed, len(cameras)])
    noisy = noisy_stations(A, se3.inverse(cameras), NOISE, trials, rng)
    d = se3.difference(solve_batch(*noisy, noise=NOISE).mount_T_camera, X)
    return np.sqrt([np.mean(np.sum(d[:, part] ** 2, axis=1)) for part in (slice(3, 6), slice(3))])


def rows(count: int, effort: Effort):
    usual = PlanOptions(given=NOISE)
    layouts = {
        "paper's circle": (planned, count, usual),
        "best at random": (at_random, count, effort.seed),
        "optimized": (planned, count, replace(usual, optimize=True)),
    }
    for name, call in layouts.items():
        cameras, seconds = timed(*call)
        best = error(cameras)
        ratios = simulated(cameras, effort.trials, effort.seed) / (best.rotation, best.translation)
        predicted = (1e3 * best.rotation, 1e3 * best.translation)
        yield (count, name, *predicted, *ratios, seconds)


def tables(effort: Effort) -> Iterator[Table]:
    found = [each for count in numbers(effort.planned) for each in rows(count, effort)]
    yield Table("planning", "Plans", HEADS, found, NOTE)
