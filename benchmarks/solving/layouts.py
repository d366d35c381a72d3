"""Stations with a known answer, the noise in them, and the least error they allow."""

from __future__ import annotations

import numpy as np

from handeye_cli import Noise, solvers
from handeye_cli.geometry import rotations, se3, star
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.predict import solution_covariance
from handeye_cli.solvers import Problem, Solution

INCH, MIL = 0.0254, 25.4e-6
NOISE = Noise(1.5e-3, 5 * MIL, 1.5e-3, 3 * MIL)
DEEP = np.diag([0.03, 0.03, 0.3, 1.5, 1.5, 0.2]) * 1e-3
"""Sigmas (m, rad) of a camera's pose as its extrinsics are: depth and tilt are the worst."""


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def paper_layout(rng, count):
    """The base setting of the paper's simulation; both noises are isotropic."""
    B = se3.inverse(generate_stations(count, 6.65 * INCH, np.radians(30)))
    of_camera = isotropic_covariance(NOISE.camera_rotation, NOISE.camera_translation)
    return B, np.tile(of_camera, (count, 1, 1))


def general_layout(rng, count):
    """Axes in all directions, distances of 0.3 to 0.6 m, camera noise along its own axes."""
    turns = rotations.exp(0.5 * rng.normal(size=(count, 3)))
    away = np.column_stack([0.05 * rng.normal(size=(count, 2)), rng.uniform(0.3, 0.6, count)])
    return se3.from_parts(turns, away), np.tile(DEEP**2, (count, 1, 1))


def perfect(rng, layout, count):
    B, of_camera = layout(rng, count)
    X = se3.from_parts(rotations.exp(rng.uniform(0, np.pi) * unit(rng)), 9.5 * INCH * unit(rng))
    Z = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.6 * unit(rng))
    return Z @ se3.inverse(B) @ se3.inverse(X), B, X, Z, of_camera


def noisy(rng, A, B, of_camera, trials):
    of_robot = isotropic_covariance(NOISE.robot_rotation, NOISE.robot_translation)
    root = np.linalg.cholesky(of_camera)
    shape = (trials, len(A), 6)
    robot = se3.perturb(A, np.sqrt(np.diag(of_robot)) * rng.normal(size=shape))
    return robot, se3.perturb(B, np.einsum("nij,tnj->tni", root, rng.normal(size=shape)))


def bound(A, B, X, Z, of_camera):
    """Root of the Cramer-Rao bound of rotation and translation."""
    joint = np.zeros((len(A), 12, 12))
    joint[:, :6, :6] = isotropic_covariance(NOISE.robot_rotation, NOISE.robot_translation)
    joint[:, 6:, 6:] = of_camera
    problem = Problem(A, B, star.star_pairs(len(A)), joint)
    influence = solvers.load("maximum-likelihood").influence(problem, Solution(X, Z))
    variance = np.diag(solution_covariance(influence, joint)[:6, :6])
    return np.sqrt([variance[3:].sum(), variance[:3].sum()])


def rms(found, X):
    d = se3.difference(found, X)
    return np.sqrt([np.mean(np.sum(part**2, axis=1)) for part in (d[:, 3:], d[:, :3])])
