"""What every registered solver owes: exactness, batches, laws of frames, and its own derivative."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disturbed, general_scene, joint_covariance, problem, scene

from handeye_cli import solvers
from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)
ANGLES = [0.3, 2.0, np.pi - 1e-3, np.pi - 1e-7, np.pi]
METHODS = solvers.names()


def error(found, truth):
    return float(np.max(np.abs(se3.difference(found, truth))))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("count", [3, 4, 6, 7, 10, 24])
def test_perfect_stations_give_the_truth(method, count, angle):
    rng = np.random.default_rng(count)
    for _ in range(5):
        perfect = scene(rng, count, angle=angle)
        found = solvers.load(method).solve(problem(perfect, NOISE))
        assert error(found.X, perfect.X) < 1e-10
        assert error(found.Z, perfect.Z) < 1e-10
        assert found.converged


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_about_the_frame_axes(method, axis):
    rng = np.random.default_rng(5)
    base = scene(rng, 7)
    X = se3.from_parts(rotations.exp(np.pi * axis), base.X[:3, 3])
    A = base.Z @ se3.inverse(base.B) @ se3.inverse(X)
    found = solvers.load(method).solve(
        Problem(A, base.B, problem(base, NOISE).pairs, joint_covariance(7, NOISE))
    )
    assert error(found.X, X) < 1e-10


@pytest.mark.parametrize("method", METHODS)
def test_a_batch_is_a_loop(method):
    rng = np.random.default_rng(7)
    perfect = scene(rng, 5)
    one = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, one.covariance[:, :6, :6], trials=6).reshape(2, 3, 5, 4, 4)
    B = disturbed(rng, perfect.B, one.covariance[:, 6:, 6:], trials=6).reshape(2, 3, 5, 4, 4)
    solver = solvers.load(method)
    batch = solver.solve(Problem(A, B, one.pairs, one.covariance))
    assert batch.X.shape == (2, 3, 4, 4)
    for i in range(2):
        for j in range(3):
            single = solver.solve(Problem(A[i, j], B[i, j], one.pairs, one.covariance))
            assert error(batch.X[i, j], single.X) < 1e-9
            assert error(batch.Z[i, j], single.Z) < 1e-9


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("angle", [0.7, 2.9, np.pi])
def test_influence_is_the_derivative(method, angle):
    rng = np.random.default_rng(11)
    perfect = scene(rng, 5, angle=angle)
    at = problem(perfect, NOISE)
    solver = solvers.load(method)
    solution = solver.solve(at)
    influence = solver.influence(at, solution)
    step = 1e-6
    for station in range(5):
        for column in range(12):
            moved = []
            for sign in (1.0, -1.0):
                A, B = at.A.copy(), at.B.copy()
                side, axis = (A, column) if column < 6 else (B, column - 6)
                side[station] = se3.perturb(side[station], sign * step * np.eye(6)[axis])
                found = solver.solve(Problem(A, B, at.pairs, at.covariance))
                moved.append(
                    np.concatenate(
                        [se3.difference(found.X, perfect.X), se3.difference(found.Z, perfect.Z)]
                    )
                )
            numeric = (moved[0] - moved[1]) / (2 * step)
            np.testing.assert_allclose(influence[station, :, column], numeric, atol=2e-6)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=15, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 10_000))
def test_another_reference_frame_changes_nothing_in_the_answer(method, seed):
    """The robot's base can be anywhere; noise moves along with it."""
    rng = np.random.default_rng(seed)
    perfect = general_scene(rng, 6)
    at = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6])
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:])
    other = se3.from_parts(rotations.exp(rng.normal(size=3)), np.zeros(3))
    solver = solvers.load(method)
    here = solver.solve(Problem(A, B, at.pairs, at.covariance))
    there = solver.solve(Problem(other @ A, B, at.pairs, at.covariance))
    assert error(there.X, here.X) < 1e-8
    assert error(there.Z, other @ here.Z) < 1e-8


@pytest.mark.parametrize("method", METHODS)
def test_predicted_covariance_is_the_sampled_one(method):
    rng = np.random.default_rng(13)
    perfect = scene(rng, 6)
    at = problem(perfect, NOISE)
    trials = 3000
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6], trials)
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:], trials)
    solver = solvers.load(method)
    found = solver.solve(Problem(A, B, at.pairs, at.covariance))
    errors = np.concatenate(
        [se3.difference(found.X, perfect.X), se3.difference(found.Z, perfect.Z)], axis=-1
    )
    K = solver.influence(at, solver.solve(at))
    predicted = np.einsum("nij,njk,nlk->il", K, at.covariance, K)
    whitened = np.linalg.solve(np.linalg.cholesky(predicted), errors.T)
    scatter = np.linalg.eigvalsh(whitened @ whitened.T / trials)
    # eigenvalues of a 12-dimensional Wishart of 3000 samples lie within 1 +- 2 sqrt(12 / 3000)
    spread = 2.5 * np.sqrt(12 / trials)
    assert 1 - spread < scatter[0] <= scatter[-1] < 1 + spread


def test_an_unknown_method_is_refused_with_the_nearest():
    with pytest.raises(UsageError, match=r"'tsai-lens'.*did you mean tsai-lenz"):
        solvers.load("tsai-lens")
