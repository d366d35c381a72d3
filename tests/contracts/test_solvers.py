"""What every registered solver owes: exactness, batches, laws of frames, and its own derivative."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disturbed, general_scene, joint_covariance, problem, scene

from handeye_cli import solvers
from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3, star
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)
COUNTS_AND_ANGLES = [
    (3, 0.3), (3, np.pi - 1e-7), (3, np.pi), (4, 2.0), (4, np.pi), (6, np.pi - 1e-3),
    (7, np.pi - 1e-7), (10, 0.3), (10, np.pi), (24, 2.0), (24, np.pi - 1e-3),
]  # fmt: skip
METHODS = solvers.names()
TARGET_ORIGIN_MATTERS = {
    "maximum-likelihood": "the given covariance is that of the pose of this origin, not of another",
}


def error(found, truth):
    return float(np.max(np.abs(se3.difference(found, truth))))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("count", "angle"), COUNTS_AND_ANGLES)
def test_perfect_stations_give_the_truth(method, count, angle):
    rng = np.random.default_rng(count)
    scenes = [scene(rng, count, angle=angle) for _ in range(5)]
    A, B, X, Z = (np.stack([getattr(each, name) for each in scenes]) for name in "ABXZ")
    at = problem(scenes[0], NOISE)
    found = solvers.load(method).solve(Problem(A, B, at.pairs, at.covariance))
    assert error(found.X, X) < 1e-10
    assert error(found.Z, Z) < 1e-10
    assert found.converged


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("count", [3, 8])
def test_perfect_stations_of_a_general_layout(method, count):
    rng = np.random.default_rng(count)
    for _ in range(5):
        perfect = general_scene(rng, count)
        found = solvers.load(method).solve(problem(perfect, NOISE))
        assert error(found.X, perfect.X) < 1e-9
        assert error(found.Z, perfect.Z) < 1e-9


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
@pytest.mark.parametrize("choose", [star.star_pairs, star.all_pairs])
def test_half_turns_between_stations(method, choose):
    """Tilts of 90 deg put opposite stations exactly a half turn apart: the axis' sign is open."""
    rng = np.random.default_rng(19)
    for _ in range(5):
        perfect = scene(rng, 4, tilt_deg=90.0)
        found = solvers.load(method).solve(problem(perfect, NOISE, pairs=choose(4)))
        assert error(found.X, perfect.X) < 1e-10
        assert error(found.Z, perfect.Z) < 1e-10


@cache
def half_turned(noise):
    """Two hundred scenes of three stations, all of them half turns apart."""
    rng = np.random.default_rng(23)
    turns = np.array([np.diag([1.0, 1, 1]), np.diag([1.0, -1, -1]), np.diag([-1.0, -1, 1])])
    joint = np.tile(noise**2 / 3.0 * np.eye(12), (3, 1, 1))
    scenes = [scene(rng, 3) for _ in range(200)]
    X, Z = (np.stack([getattr(each, name) for each in scenes]) for name in "XZ")
    first = rotations.exp(rng.normal(size=(200, 1, 3)))
    B = se3.from_parts(turns @ first, rng.normal(size=(200, 3, 3)))
    A = Z[:, None] @ se3.inverse(B) @ se3.inverse(X)[:, None]
    moves = noise / np.sqrt(3.0) * rng.normal(size=(2, 200, 3, 6))
    A, B = se3.perturb(A, moves[0]), se3.perturb(B, moves[1])
    return Problem(A, B, star.star_pairs(3), joint), X


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("noise", [1e-12, 1e-3])
def test_half_turns_between_all_stations(method, noise):
    """Rotations alone then fit four answers; the translations tell which is right."""
    at, X = half_turned(noise)
    found = solvers.load(method).solve(at)
    apart = rotations.angle(np.swapaxes(found.X[:, :3, :3], 1, 2) @ X[:, :3, :3])
    assert np.max(apart) < 5 * noise + 1e-9


@pytest.mark.parametrize("method", METHODS)
def test_noise_does_no_more_harm_beside_half_turns(method):
    """Stations almost a half turn apart, where noise takes the angle to either side of pi."""
    rng = np.random.default_rng(29)
    perfect = scene(rng, 4, tilt_deg=89.97)
    at = problem(perfect, NOISE, pairs=star.all_pairs(4))
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6], 300)
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:], 300)
    found = solvers.load(method).solve(Problem(A, B, at.pairs, at.covariance))
    apart = se3.difference(found.X, perfect.X)
    assert 0.5e-3 < np.sqrt(np.mean(np.sum(apart[:, 3:] ** 2, axis=1))) < 2e-3
    assert 0.1e-3 < np.sqrt(np.mean(np.sum(apart[:, :3] ** 2, axis=1))) < 1e-3


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
    moves = step * np.eye(60).reshape(60, 5, 12)
    moves = np.stack([moves, -moves])
    A, B = se3.perturb(at.A, moves[..., :6]), se3.perturb(at.B, moves[..., 6:])
    found = solver.solve(Problem(A, B, at.pairs, at.covariance))
    apart = [se3.difference(found.X, perfect.X), se3.difference(found.Z, perfect.Z)]
    moved = np.concatenate(apart, axis=-1)
    numeric = ((moved[0] - moved[1]) / (2 * step)).reshape(5, 12, 12)
    np.testing.assert_allclose(influence, np.swapaxes(numeric, 1, 2), atol=2e-6)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=5, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 10_000))
def test_another_reference_frame_changes_nothing_in_the_answer(method, seed):
    """The robot's base can be anywhere; noise moves along with it."""
    rng = np.random.default_rng(seed)
    perfect = general_scene(rng, 6)
    at = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6])
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:])
    other = se3.from_parts(rotations.exp(rng.normal(size=3)), np.array([0.7, -0.4, 1.1]))
    solver = solvers.load(method)
    here = solver.solve(Problem(A, B, at.pairs, at.covariance))
    there = solver.solve(Problem(other @ A, B, at.pairs, at.covariance))
    assert error(there.X, here.X) < 1e-8
    assert error(there.Z, other @ here.Z) < 1e-8


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=5, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 10_000))
def test_another_target_frame_changes_nothing_in_the_answer(method, seed):
    """The corner of the target that counts as its origin is arbitrary."""
    rng = np.random.default_rng(seed)
    perfect = general_scene(rng, 6)
    at = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6])
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:])
    shift = np.zeros(3) if method in TARGET_ORIGIN_MATTERS else rng.normal(size=3)
    other = se3.from_parts(rotations.exp(rng.normal(size=3)), shift)
    solver = solvers.load(method)
    here = solver.solve(Problem(A, B, at.pairs, at.covariance))
    there = solver.solve(Problem(A, B @ other, at.pairs, at.covariance))
    assert error(there.X, here.X) < 1e-8


@pytest.mark.parametrize("method", TARGET_ORIGIN_MATTERS)
def test_the_origin_of_the_target_matters_only_within_the_noise(method):
    rng = np.random.default_rng(31)
    perfect = general_scene(rng, 6)
    at = problem(perfect, NOISE)
    other = se3.from_parts(np.eye(3), np.array([0.3, -0.2, 0.1]))
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6])
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:])
    solver = solvers.load(method)
    here = solver.solve(Problem(A, B, at.pairs, at.covariance))
    there = solver.solve(Problem(A, B @ other, at.pairs, at.covariance))
    assert 1e-8 < error(there.X, here.X) < 5e-3, TARGET_ORIGIN_MATTERS[method]


@cache
def sampled(trials):
    """A scene, its problem without noise, and the problem of many draws of the noise."""
    rng = np.random.default_rng(13)
    perfect = scene(rng, 6)
    at = problem(perfect, NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6], trials)
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:], trials)
    return perfect, at, Problem(A, B, at.pairs, at.covariance)


@pytest.mark.parametrize("method", METHODS)
def test_predicted_covariance_is_the_sampled_one(method):
    trials = 2000
    perfect, at, draws = sampled(trials)
    solver = solvers.load(method)
    found = solver.solve(draws)
    errors = np.concatenate(
        [se3.difference(found.X, perfect.X), se3.difference(found.Z, perfect.Z)], axis=-1
    )
    K = solver.influence(at, solver.solve(at))
    predicted = np.einsum("nij,njk,nlk->il", K, at.covariance, K)
    whitened = np.linalg.solve(np.linalg.cholesky(predicted), errors.T)
    scatter = np.linalg.eigvalsh(whitened @ whitened.T / trials)
    # eigenvalues of a 12-dimensional Wishart of 2000 samples lie within 1 +- 2 sqrt(12 / 2000)
    spread = 2.5 * np.sqrt(12 / trials)
    assert 1 - spread < scatter[0] <= scatter[-1] < 1 + spread


def test_an_unknown_method_is_refused_with_the_nearest():
    with pytest.raises(UsageError, match=r"'tsai-lens'.*did you mean tsai-lenz"):
        solvers.load("tsai-lens")
