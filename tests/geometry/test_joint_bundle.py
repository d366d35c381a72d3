"""The joint estimate of poses and intrinsics: derivatives, blocks against dense, its optimum."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import joint_bundle, se3
from handeye_cli.geometry.camera import Lens, project
from handeye_cli.geometry.joint_bundle import JointProblem, JointState, Prior
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.pnp import Sightings

PLATE = 0.03 * np.array([[x - 2.5, y - 2.0, 0.0] for y in range(5) for x in range(6)])
TRUTH = np.array([900.0, 905.0, 640.0, 500.0, -0.2, 0.05])
SPREAD = np.diag([2.0, 2.0, 1.5, 1.5, 0.01, 0.02])
SIGMA = 0.2
ROBOT = isotropic_covariance(8e-4, 1.5e-4)
EXACT = np.zeros((6, 0))


def true_state(count: int, shared: int, seed: int = 1) -> tuple[np.ndarray, JointState]:
    """Robot poses without noise, and the state that closes their loops."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform([-0.6, -0.6, -1.0], [0.6, 0.6, 1.0], (count, 3))
    places = rng.uniform([-0.05, -0.05, 0.3], [0.05, 0.05, 0.45], (count, 3))
    B = se3.from_parts(Rotation.from_rotvec(turns).as_matrix(), places)
    X = se3.from_parts(Rotation.from_rotvec([0.3, -1.2, 0.5]).as_matrix(), [0.05, -0.1, 0.08])
    Z = se3.from_parts(Rotation.from_rotvec([2.0, 0.4, -0.3]).as_matrix(), [0.6, 0.1, 0.2])
    A = Z @ se3.inverse(X @ B)
    return A, JointState(X, Z, np.zeros((count, 6)), np.zeros(shared))


def noisy(rng, A, state, directions, prior=0.0, *, lens=TRUTH, sigma=SIGMA, robot=ROBOT):
    """A problem with noise on the pixels and on the robot's poses."""
    poses = se3.inverse(A @ state.X) @ state.Z
    pixels = project(se3.transform_points(poses, PLATE), TRUTH)
    pixels = pixels + sigma * rng.normal(size=pixels.shape)
    off = rng.normal(size=(len(A), 6)) @ np.linalg.cholesky(robot).T
    size = directions.shape[1]
    return JointProblem(
        A=se3.perturb(A, off),
        seen=Sightings(PLATE, pixels, np.ones(pixels.shape[:-1], dtype=bool)),
        sigma=np.full(len(A), sigma),
        lens=Lens(lens),
        directions=directions,
        prior=Prior(prior * np.eye(size), np.zeros(size)),
    )


def robot_of(problem: JointProblem, robot: np.ndarray = ROBOT) -> np.ndarray:
    return np.tile(robot, (len(problem.A), 1, 1))


def all_residuals(problem: JointProblem, state: JointState, robot: np.ndarray) -> np.ndarray:
    """Everything that is squared, written down a second time."""
    parameters = problem.lens.parameters + problem.directions @ state.shared
    A = se3.perturb(problem.A, state.robot)
    poses = np.linalg.inv(A @ state.X) @ state.Z
    pixels = project(se3.transform_points(poses, problem.seen.points), parameters)
    off = (pixels - problem.seen.pixels)[problem.seen.mask] / problem.sigma[0]
    white = state.robot @ np.linalg.inv(np.linalg.cholesky(robot)).T
    known = np.linalg.cholesky(problem.prior.information + 1e-300 * np.eye(len(state.shared))).T
    return np.concatenate([off.ravel(), white.ravel(), known @ state.shared])


def moved(state: JointState, step: np.ndarray) -> JointState:
    shared = len(state.shared)
    return JointState(
        se3.perturb(state.X, step[:6]),
        se3.perturb(state.Z, step[6:12]),
        state.robot + step[12 + shared :].reshape(-1, 6),
        state.shared + step[12 : 12 + shared],
    )


def dense_information(problem: JointProblem, state: JointState, robot: np.ndarray) -> np.ndarray:
    """All unknowns' normal equations by central differences, X, Z and the intrinsics first."""
    size = 12 + len(state.shared) + state.robot.size
    h = 1e-6
    J = np.stack(
        [
            all_residuals(problem, moved(state, h * e), robot)
            - all_residuals(problem, moved(state, -h * e), robot)
            for e in np.eye(size)
        ],
        axis=-1,
    )
    return J.T @ J / (2 * h) ** 2


@pytest.mark.parametrize("directions", [EXACT, SPREAD, SPREAD[:, :2]])
def test_covariance_is_that_of_the_dense_normal_equations(directions):
    A, state = true_state(4, directions.shape[1])
    problem = noisy(np.random.default_rng(2), A, state, directions, prior=1.0)
    covariance = robot_of(problem)
    found = joint_bundle.refine(problem, covariance, state)
    blocks = joint_bundle.influence(found.linear, covariance).covariance
    dense = np.linalg.inv(dense_information(problem, found.state, ROBOT))[: len(blocks)]
    sigma = np.sqrt(np.diag(blocks))
    expected = dense[:, : len(blocks)]
    assert np.max(np.abs(blocks - expected) / np.outer(sigma, sigma)) < 1e-4


def test_view_information_by_central_differences():
    A, state = true_state(3, 6)
    problem = noisy(np.random.default_rng(3), A, state, SPREAD, sigma=1e-9)
    poses = se3.inverse(A @ state.X) @ state.Z
    seen, sigma = problem.seen, np.full(3, SIGMA)
    h = 1e-4
    for k in range(6):
        best = []
        for sign in (1.0, -1.0):
            lens = Lens(TRUTH + sign * h * SPREAD[:, k])
            view = joint_bundle.view_information(poses, seen, sigma, lens, SPREAD)
            best.append(view.offsets)
        view = joint_bundle.view_information(poses, seen, sigma, Lens(TRUTH), SPREAD)
        slope = (best[0] - best[1]) / (2 * h)
        sigmas = np.sqrt(np.einsum("nii->ni", view.covariance))
        assert np.max(np.abs(slope - view.by_shared[..., k]) / sigmas) < 1e-3


def test_views_in_chunks_are_those_in_one(monkeypatch):
    A, state = true_state(7, 6)
    problem = noisy(np.random.default_rng(4), A, state, SPREAD)
    poses = se3.inverse(A @ state.X) @ state.Z
    given = poses, problem.seen, problem.sigma, problem.lens, SPREAD
    whole = joint_bundle.view_information(*given)
    monkeypatch.setattr(joint_bundle, "_CHUNK", 3)
    chunks = joint_bundle.view_information(*given)
    for name in ("offsets", "covariance", "by_shared", "information", "gradient"):
        np.testing.assert_allclose(getattr(chunks, name), getattr(whole, name), rtol=1e-12)


@pytest.mark.parametrize(("directions", "prior"), [(EXACT, 0.0), (SPREAD, 0.0), (SPREAD, 1.0)])
def test_the_optimum_is_that_of_a_general_solver(directions, prior):
    size = directions.shape[1]
    A, state = true_state(5, size, seed=5)
    off = SPREAD @ np.array([0.8, -0.5, 1.0, 0.3, -0.7, 0.4]) if size else np.zeros(6)
    problem = noisy(np.random.default_rng(6), A, state, directions, prior, lens=TRUTH + off)
    covariance = robot_of(problem)
    rough = np.random.default_rng(7).normal(size=12) * np.repeat([3e-3, 0.01, 3e-3, 0.01], 3)
    start = moved(state, np.concatenate([rough, np.zeros(size + 6 * len(A))]))
    found = joint_bundle.refine(problem, covariance, start)
    assert found.converged
    scale = np.concatenate([np.full(12, 1e-3), np.ones(size), np.full(6 * len(A), 1e-4)])
    best = least_squares(
        lambda step: all_residuals(problem, moved(found.state, scale * step), ROBOT),
        np.full(len(scale), 0.1),
        # one-sided differences would leave a hundredth of a standard deviation
        jac="3-point",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    sigma = np.sqrt(np.diag(joint_bundle.influence(found.linear, covariance).covariance))
    assert np.max(np.abs((scale * best.x)[: len(sigma)]) / sigma) < 0.01
    robot = (scale * best.x)[len(sigma) :].reshape(-1, 6) / np.sqrt(np.diag(ROBOT))
    assert np.max(np.abs(robot)) < 0.01


def test_covariance_and_influence_predict_the_sampled_errors():
    trials = 80
    A, state = true_state(6, 6, seed=8)
    rng = np.random.default_rng(9)
    white = []
    for _ in range(trials):
        problem = noisy(rng, A, state, SPREAD)
        found = joint_bundle.refine(problem, robot_of(problem), state)
        moves = joint_bundle.influence(found.linear, robot_of(problem))
        error = np.concatenate(
            [se3.difference(found.state.X, state.X), se3.difference(found.state.Z, state.Z)]
        )
        error = np.concatenate([error, found.state.shared])
        white.append(np.linalg.solve(np.linalg.cholesky(moves.covariance), error))
    squares = np.sum(np.square(white))
    # Chi-square with 18 degrees of freedom each; four standard deviations either way.
    assert abs(squares - 18 * trials) < 4 * np.sqrt(2 * 18 * trials)
    both = np.zeros((6, 12, 12))
    both[:, :6, :6], both[:, 6:, 6:] = ROBOT, found.linear.camera_covariance
    parts = moves.by_poses @ both @ np.swapaxes(moves.by_poses, -1, -2)
    np.testing.assert_allclose(
        parts.sum(axis=0) + moves.shared, moves.covariance, rtol=1e-6, atol=1e-15
    )


@pytest.mark.parametrize("level", [1e-9, 1e-5])
def test_a_perfect_robot_is_no_singularity(level):
    A, state = true_state(5, 6, seed=10)
    robot = isotropic_covariance(level, level)
    problem = noisy(np.random.default_rng(11), A, state, SPREAD, robot=robot)
    found = joint_bundle.refine(problem, robot_of(problem, robot), state)
    assert found.converged
    moves = joint_bundle.influence(found.linear, robot_of(problem, robot))
    error = se3.difference(found.state.X, state.X)
    assert error @ np.linalg.solve(moves.covariance[:6, :6], error) < 25.0


def test_perfect_data_give_the_exact_answer():
    A, state = true_state(4, 6, seed=12)
    off = SPREAD @ np.full(6, 0.5)
    tiny = isotropic_covariance(1e-9, 1e-9)
    problem = noisy(
        np.random.default_rng(13), A, state, SPREAD, lens=TRUTH + off, sigma=1e-6, robot=tiny
    )
    found = joint_bundle.refine(problem, robot_of(problem, tiny), state)
    assert found.converged
    np.testing.assert_allclose(found.state.X, state.X, atol=1e-6)
    np.testing.assert_allclose(problem.lens_at(found.state.shared).parameters, TRUTH, atol=1e-3)


def test_points_that_were_not_seen_are_ignored():
    A, state = true_state(5, 6, seed=14)
    problem = noisy(np.random.default_rng(15), A, state, SPREAD)
    mask = np.random.default_rng(16).random(problem.seen.mask.shape) < 0.7
    pixels = np.where(mask[..., None], problem.seen.pixels, np.nan)
    holes = replace(problem, seen=replace(problem.seen, pixels=pixels, mask=mask))
    found = joint_bundle.refine(holes, robot_of(problem), state)
    assert found.converged
    assert np.all(np.isfinite(found.state.X))


def test_too_few_steps_are_told(monkeypatch):
    A, state = true_state(5, 6, seed=17)
    problem = noisy(np.random.default_rng(18), A, state, SPREAD)
    monkeypatch.setattr(joint_bundle, "_MAX_STEPS", 1)
    assert not joint_bundle.refine(problem, robot_of(problem), state).converged


def test_directions_leave_out_what_is_exact():
    root = np.array([[2.0, 0.0], [0.5, 0.1], [0.0, 0.0]])
    found = joint_bundle.uncertain_directions(root @ root.T)
    assert found.shape == (3, 2)
    np.testing.assert_allclose(found @ found.T, root @ root.T, atol=1e-12)
    assert joint_bundle.uncertain_directions(np.zeros((3, 3))).shape == (3, 0)
