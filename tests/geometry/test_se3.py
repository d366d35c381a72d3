"""Rigid transforms against plain 4x4 algebra, central differences and the group's laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from handeye_cli.geometry import rotations, se3

ROUNDING = 64 * np.finfo(float).eps
"""Of a few products of elements up to 3."""
STEP = 1e-5
DIFFERENCE = 5e-10
"""Of a central difference: rounding / STEP, and STEP^2 times a third derivative near 1."""

law = settings(max_examples=50, derandomize=True, database=None, deadline=None)
element = st.floats(-3.0, 3.0, allow_subnormal=False)
twists = st.tuples(*[element] * 6).map(np.array)
short = twists.filter(lambda d: np.linalg.norm(d[3:]) < 3.0)


def random_poses(shape: tuple[int, ...], seed: int, turn: float = 1.0) -> np.ndarray:
    """Transforms built by the 4x4 matrix exponential, which none of the kernels uses."""
    rng = np.random.default_rng(seed)
    twist = np.zeros((*shape, 4, 4))
    twist[..., :3, :3] = turn * rotations.skew(rng.normal(size=(*shape, 3)))
    twist[..., :3, 3] = rng.normal(size=(*shape, 3))
    flat = [expm(one) for one in twist.reshape(-1, 4, 4)]
    return np.array(flat).reshape(*shape, 4, 4)


def pose(d: np.ndarray) -> np.ndarray:
    return se3.perturb(np.eye(4), d)


def numeric(moved_by) -> np.ndarray:
    """Central difference of a function of (6, 6) perturbations, as columns."""
    steps = STEP * np.eye(6)
    return ((moved_by(steps) - moved_by(-steps)) / (2 * STEP)).T


def test_from_parts_broadcasts_rotations_and_translations():
    R = random_poses((4, 1), 1)[..., :3, :3]
    t = np.random.default_rng(2).normal(size=(5, 3))
    T = se3.from_parts(R, t)
    assert T.shape == (4, 5, 4, 4)
    for i in range(4):
        for j in range(5):
            assert np.array_equal(T[i, j], np.block([[R[i, 0], t[j][:, None]], [0, 0, 0, 1]]))


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_inverse_is_the_matrix_inverse(shape):
    T = random_poses(shape, 3)
    assert se3.inverse(T) == pytest.approx(np.linalg.inv(T), abs=ROUNDING)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_points_are_carried_like_homogeneous_vectors(shape):
    T = random_poses(shape, 4)
    points = np.random.default_rng(5).normal(size=(7, 3))
    homogeneous = np.concatenate([points, np.ones((7, 1))], axis=1)
    expected = np.einsum("...ij,nj->...ni", T, homogeneous)[..., :3]
    assert se3.transform_points(T, points) == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_perturb_moves_in_the_parent_frame(shape):
    T = random_poses(shape, 6)
    d = np.random.default_rng(7).normal(size=(*shape, 6))
    moved = se3.perturb(T, d)
    turned = rotations.exp(d[..., 3:]) @ T[..., :3, :3]
    assert moved[..., :3, 3] == pytest.approx(T[..., :3, 3] + d[..., :3], abs=ROUNDING)
    assert moved[..., :3, :3] == pytest.approx(turned, abs=ROUNDING)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 1.0])
def test_difference_undoes_perturb(size):
    T = random_poses((2, 20), 8)
    d = size * np.random.default_rng(9).uniform(-1.5, 1.5, (2, 20, 6))
    assert se3.difference(se3.perturb(T, d), T) == pytest.approx(d, abs=ROUNDING)


def test_perturb_undoes_difference():
    T, origin = random_poses((2, 30), 10)
    assert se3.perturb(origin, se3.difference(T, origin)) == pytest.approx(T, abs=ROUNDING)


@pytest.mark.parametrize("turn", [0.0, 0.01, 1.0])
def test_compose_jacobians_against_central_differences(turn):
    A, B = random_poses((2,), 11, turn)
    by_A, by_B = se3.compose_jacobians(A, B)
    first = numeric(lambda d: se3.difference(se3.perturb(A, d) @ B, A @ B))
    second = numeric(lambda d: se3.difference(A @ se3.perturb(B, d), A @ B))
    assert by_A == pytest.approx(first, abs=DIFFERENCE)
    assert by_B == pytest.approx(second, abs=DIFFERENCE)


@pytest.mark.parametrize("turn", [0.0, 0.01, 1.0])
def test_inverse_jacobian_against_central_differences(turn):
    T = random_poses((), 12, turn)
    back = np.linalg.inv(T)
    expected = numeric(lambda d: se3.difference(np.linalg.inv(se3.perturb(T, d)), back))
    assert se3.inverse_jacobian(T) == pytest.approx(expected, abs=DIFFERENCE)


def test_jacobians_batch_like_a_loop():
    A, B = random_poses((2, 2, 3), 13)
    by_A, by_B = se3.compose_jacobians(A, B)
    by_T = se3.inverse_jacobian(A)
    for i in range(2):
        for j in range(3):
            one_A, one_B = se3.compose_jacobians(A[i, j], B[i, j])
            assert one_A == pytest.approx(by_A[i, j], abs=ROUNDING)
            assert one_B == pytest.approx(by_B[i, j], abs=ROUNDING)
            assert se3.inverse_jacobian(A[i, j]) == pytest.approx(by_T[i, j], abs=ROUNDING)


def test_compose_jacobians_broadcast_one_factor():
    A, B = random_poses((5,), 14), random_poses((), 15)
    by_A, by_B = se3.compose_jacobians(A, B)
    assert by_A.shape == by_B.shape == (5, 6, 6)
    by_A, by_B = se3.compose_jacobians(B, A)
    assert by_A.shape == (5, 6, 6)
    assert np.array_equal(by_B, se3.compose_jacobians(B, np.eye(4))[1])


def test_covariance_goes_through_a_product_as_sampled():
    rng = np.random.default_rng(16)
    A, B = random_poses((2,), 17)
    root = 1e-4 * rng.normal(size=(6, 6))
    trials = 20_000
    sampled = se3.difference(A @ se3.perturb(B, rng.normal(size=(trials, 6)) @ root.T), A @ B)
    _, by_B = se3.compose_jacobians(A, B)
    white = np.linalg.solve(by_B @ root, sampled.T)
    # The sample covariance of white noise is I within a few 1 / sqrt(trials).
    assert white @ white.T / trials == pytest.approx(np.eye(6), abs=6 / np.sqrt(trials))


@law
@given(d=twists)
def test_law_the_inverse_cancels_on_both_sides(d):
    T = pose(d)
    assert T @ se3.inverse(T) == pytest.approx(np.eye(4), abs=ROUNDING)
    assert se3.inverse(se3.inverse(T)) == pytest.approx(T, abs=ROUNDING)


@law
@given(d=twists, e=twists)
def test_law_the_inverse_of_a_product_reverses_it(d, e):
    A, B = pose(d), pose(e)
    expected = se3.inverse(B) @ se3.inverse(A)
    assert se3.inverse(A @ B) == pytest.approx(expected, abs=4 * ROUNDING)


@law
@given(d=twists, e=twists)
def test_law_carrying_points_composes(d, e):
    A, B = pose(d), pose(e)
    points = np.array([[0.0, 0.0, 0.0], [1.0, -2.0, 0.5]])
    stepwise = se3.transform_points(A, se3.transform_points(B, points))
    assert se3.transform_points(A @ B, points) == pytest.approx(stepwise, abs=4 * ROUNDING)


@law
@given(d=twists, e=short)
def test_law_difference_is_the_inverse_of_perturb(d, e):
    origin = pose(d)
    assert se3.difference(se3.perturb(origin, e), origin) == pytest.approx(e, abs=4 * ROUNDING)


@law
@given(d=short, e=short)
def test_law_jacobians_of_products_chain(d, e):
    """The product with an inverse does not move when both factors move together."""
    A, B = pose(d), pose(e)
    by_A, by_AB = se3.compose_jacobians(se3.inverse(A), A @ B)
    inner, _ = se3.compose_jacobians(A, B)
    total = by_A @ se3.inverse_jacobian(A) + by_AB @ inner
    assert total == pytest.approx(np.zeros((6, 6)), abs=16 * ROUNDING)


def test_mean_is_the_plain_mean_of_places_and_half_way_between_turns():
    a = random_poses((), 18)
    d = np.array([0.2, -0.4, 0.6, 0.3, -0.5, 0.2])
    middle = se3.mean(np.stack([a, se3.perturb(a, d)]))
    assert middle == pytest.approx(se3.perturb(a, d / 2), abs=ROUNDING)


def test_mean_of_equal_poses_is_that_pose():
    T = random_poses((4, 1), 19)
    assert se3.mean(np.broadcast_to(T, (4, 6, 4, 4))) == pytest.approx(T[:, 0], abs=ROUNDING)


def test_mean_averages_the_noise_away():
    rng = np.random.default_rng(20)
    T = random_poses((), 21)
    sigma, count, trials = 1e-3, 25, 400
    noisy = se3.perturb(T, sigma * rng.normal(size=(trials, count, 6)))
    squares = np.sum(se3.difference(se3.mean(noisy), T) ** 2, axis=1) * count / sigma**2
    # A mean of `trials` chi-squares with 6 degrees of freedom.
    assert np.mean(squares) == pytest.approx(6.0, abs=4 * np.sqrt(12 / trials))


@pytest.mark.parametrize("batch", [(), (5,), (2, 3)])
def test_squares_are_added_up_by_kind(batch):
    squares = np.random.default_rng(22).uniform(size=(*batch, 6))
    found = se3.by_kind(squares)
    assert found.shape == (*batch, 2)
    assert found[..., 0] == pytest.approx(squares[..., :3].sum(axis=-1))
    assert found[..., 1] == pytest.approx(squares[..., 3:].sum(axis=-1))
