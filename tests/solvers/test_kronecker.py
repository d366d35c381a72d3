"""Andreff and Li: the ranks of their equations, and the constrained optimum found another way."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, problem, scene
from scipy.linalg import null_space

from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, andreff, kronecker, li, robot_world, tsai_lenz
from handeye_cli.solvers.motions import interstation_motions

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)


def noisy(rng, layout, count, scale=1.0):
    at = problem(layout(rng, count), NOISE)
    A = disturbed(rng, at.A, scale**2 * at.covariance[:, :6, :6])
    B = disturbed(rng, at.B, scale**2 * at.covariance[:, 6:, 6:])
    return Problem(A, B, at.pairs, at.covariance)


def motion_equations(at):
    return andreff.equations(*interstation_motions(at.A, at.B, at.pairs))


EQUATIONS = {andreff: (motion_equations, 1), li: (robot_world.equations, 2)}
METHODS = pytest.mark.parametrize("method", EQUATIONS, ids=["andreff", "li"])


@METHODS
@pytest.mark.parametrize(("layout", "missing"), [(scene, 1), (general_scene, 0)])
def test_the_paper_layout_leaves_the_factor_open(method, layout, missing):
    """All motions keep the target's origin fixed; elsewhere the equations have full rank."""
    at = problem(layout(np.random.default_rng(2), 8), NOISE)
    rows, _ = EQUATIONS[method][0](at)
    flat = rows.reshape(-1, rows.shape[-1])
    assert np.linalg.matrix_rank(flat, tol=1e-9) == flat.shape[1] - missing


@METHODS
@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [4, 9])
def test_the_answer_is_the_constrained_optimum(method, layout, count):
    """Least squares over the complement of the rotations' elements, in the unit of the motions."""
    rng = np.random.default_rng(count)
    at = noisy(rng, layout, count)
    equations, matrices = EQUATIONS[method]
    rows, right = equations(at)
    motions = interstation_motions(at.A, at.B, at.pairs)
    unit = np.sqrt(np.mean([np.sum(m[:, :3, 3] ** 2, axis=1) for m in motions]))
    rows[:, 9:] /= unit
    right[:, 9:] /= unit
    flat, size = rows.reshape(-1, rows.shape[-1]), 9 * matrices
    # enough to be of first order: any rotations near the answer fix the factor alike
    null = np.linalg.svd(rows[:, :9, :size].reshape(-1, size))[2][-1]
    null *= np.sqrt(3 * matrices) * np.sign(np.linalg.det(null[:9].reshape(3, 3)))
    near = rotations.project_to_so3(null.reshape(-1, 3, 3)).ravel()
    start = np.append(near, np.zeros(flat.shape[1] - size))
    free = null_space(start[None])
    step = np.linalg.lstsq(flat @ free, right.ravel() - flat @ start, rcond=None)[0]
    best = start + free @ step
    found = method.solve(at)
    poses = [found.X] if method is andreff else [found.X, found.Z]
    expected = rotations.project_to_so3(best[:size].reshape(-1, 3, 3))
    for k, pose in enumerate(poses):
        np.testing.assert_allclose(pose[:3, :3], expected[k], atol=1e-8)
        np.testing.assert_allclose(pose[:3, 3], best[size + 3 * k :][:3], atol=1e-8)


@METHODS
def test_the_unit_of_length_does_not_matter(method):
    at = noisy(np.random.default_rng(3), general_scene, 6)
    scale = np.ones((4, 4))
    scale[:3, 3] = 1000.0
    in_mm = Problem(scale * at.A, scale * at.B, at.pairs, at.covariance)
    here, there = method.solve(at), method.solve(in_mm)
    np.testing.assert_allclose(there.X, scale * here.X, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(there.Z, scale * here.Z, rtol=1e-7, atol=1e-7)


@METHODS
def test_the_paper_layout_costs_no_accuracy(method):
    rng = np.random.default_rng(5)
    perfect = scene(rng, 9)
    at = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6], 500)
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:], 500)
    trials = Problem(A, B, at.pairs, at.covariance)
    squares = [
        np.mean(se3.difference(solver.solve(trials).X, perfect.X) ** 2, axis=0)
        for solver in (method, tsai_lenz)
    ]
    assert np.sum(squares[0][3:]) < 1.1 * np.sum(squares[1][3:])
    assert np.sum(squares[0][:3]) < 1.1 * np.sum(squares[1][:3])


def test_half_turns_leave_a_choice_that_the_rough_rotation_makes():
    """Half turns about two axes: two rotations fit, and the null space has two dimensions."""
    rng = np.random.default_rng(7)
    R = rotations.exp(rng.normal(size=3))
    axes = np.array([[1.0, 0.0, 0.0], [np.cos(0.8), np.sin(0.8), 0.0]])
    R_c = rotations.exp(np.pi * axes)
    rows = np.eye(9) - kronecker.kron(R @ R_c @ R.T, R_c)
    for wanted in (R, R @ rotations.exp(np.array([0.0, 0.0, np.pi]))):
        rough = rotations.exp(0.1 * rng.normal(size=3)) @ wanted
        found = kronecker.null_rotations(rows, rough[None])[0]
        np.testing.assert_allclose(R @ R_c @ R.T @ found, found @ R_c, atol=1e-12)
        assert rotations.angle(found.T @ wanted) < 1e-7
