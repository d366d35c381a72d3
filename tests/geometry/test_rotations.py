"""Rotations against SciPy, matrix exponentials and brute force, from 1e-12 rad up to pi."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from principal_axes import matrix_from_principal_axis
from scipy.linalg import expm, polar
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import rotations

ANGLES = [0.0, 1e-12, 1e-8, 1e-5, 1.0, np.pi - 1e-7, np.pi - 1e-12, np.pi]
EPS = np.finfo(float).eps
ROUNDING = 16 * EPS
"""A matrix element is a sum of three or four rounded products of numbers up to 1."""
ORDERS = ["".join(p) for p in product("xyz", repeat=3) if p[0] != p[1] and p[1] != p[2]]

law = settings(derandomize=True, database=None, deadline=None)
bounded = st.floats(-3.0, 3.0, allow_subnormal=False)
vectors = st.tuples(bounded, bounded, bounded).map(np.array)
quaternions = (
    st.tuples(bounded, bounded, bounded, bounded)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
)


def axes(count: int, seed: int) -> np.ndarray:
    drawn = np.random.default_rng(seed).normal(size=(count, 3))
    with_signs = np.concatenate([drawn, np.eye(3), -np.eye(3), [[1.0, -1.0, 0.0]]])
    return with_signs / np.linalg.norm(with_signs, axis=1, keepdims=True)


def random_rotations(shape: tuple[int, ...], seed: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(*shape, 4))
    return Rotation.from_quat(q.reshape(-1, 4)).as_matrix().reshape(*shape, 3, 3)


def up_to_sign(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Distance of vectors whose sign is open, row by row."""
    apart = np.linalg.norm(found - wanted, axis=-1)
    return np.minimum(apart, np.linalg.norm(found + wanted, axis=-1))


def test_skew_is_the_cross_product():
    a, b = np.random.default_rng(1).normal(size=(2, 7, 3))
    crossed = (rotations.skew(a) @ b[..., None])[..., 0]
    assert crossed == pytest.approx(np.cross(a, b), abs=ROUNDING)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_scipys(angle):
    v = angle * axes(50, 2)
    expected = Rotation.from_rotvec(v).as_matrix()
    assert rotations.exp(v) == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_the_matrix_exponential(angle):
    v = angle * axes(5, 3)
    expected = np.array([expm(rotations.skew(one)) for one in v])
    assert rotations.exp(v) == pytest.approx(expected, abs=4 * ROUNDING)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp_to_rounding_of_the_vector(angle):
    # Below 1 rad the error is relative: the odd part of the matrix carries every digit of the
    # vector. Towards pi it is absolute: the axis comes from elements near 1, the rest from w.
    v = angle * axes(50, 4)
    back = rotations.log(rotations.exp(v))
    apart = up_to_sign(back, v) if angle == np.pi else np.linalg.norm(back - v, axis=-1)
    if angle == np.pi - 1e-12:
        assert np.all(np.sum(back * v, axis=-1) > 0)
    assert np.max(apart) <= ROUNDING * angle


@pytest.mark.parametrize("angle", ANGLES)
def test_log_is_scipys(angle):
    turn = Rotation.from_rotvec(angle * axes(50, 5))
    found = rotations.log(turn.as_matrix())
    apart = up_to_sign(found, turn.as_rotvec()) if angle == np.pi else found - turn.as_rotvec()
    assert np.max(np.abs(apart)) <= ROUNDING * angle


@pytest.mark.parametrize("angle", ANGLES)
def test_angle_keeps_all_digits_at_both_ends(angle):
    v = angle * axes(50, 6)
    found = rotations.angle(rotations.exp(v))
    assert found == pytest.approx(np.full(len(v), angle), rel=ROUNDING, abs=0.0)
    assert found == pytest.approx(Rotation.from_rotvec(v).magnitude(), rel=ROUNDING, abs=0.0)


@pytest.mark.parametrize("angle", ANGLES)
def test_quaternions_are_scipys(angle):
    turn = Rotation.from_rotvec(angle * axes(50, 7))
    found = rotations.quaternion_from_matrix(turn.as_matrix())
    assert np.max(up_to_sign(found, turn.as_quat())) <= ROUNDING
    assert np.all(found[:, 3] >= 0)
    assert rotations.matrix_from_quaternion(found) == pytest.approx(turn.as_matrix(), abs=ROUNDING)


def test_a_quaternion_is_normalised_first():
    q = np.random.default_rng(8).normal(size=(9, 4))
    expected = Rotation.from_quat(q).as_matrix()
    for scale in (1e-9, 1.0, -7.0, 1e9):
        assert rotations.matrix_from_quaternion(scale * q) == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("order", ORDERS + [order.upper() for order in ORDERS])
def test_euler_angles_are_scipys(order):
    angles = np.random.default_rng(9).uniform(-np.pi, np.pi, (20, 3))
    expected = Rotation.from_euler(order, angles).as_matrix()
    assert rotations.matrix_from_euler(angles, order) == pytest.approx(expected, abs=2 * ROUNDING)


@pytest.mark.parametrize("order", ["", "xy", "xyzx", "xyZ", "XyZ", "abc", "rpy"])
def test_a_wrong_euler_order_is_named(order):
    with pytest.raises(ValueError, match=f"found '{order}'"):
        rotations.matrix_from_euler(np.zeros(3), order)


@pytest.mark.parametrize("angle", ANGLES)
def test_principal_axis_is_equation_9(angle):
    n = axes(50, 10)
    found = rotations.principal_axis(rotations.exp(angle * n))
    expected = 2.0 * np.sin(angle / 2.0) * n
    apart = up_to_sign(found, expected) if angle == np.pi else found - expected
    assert np.max(np.abs(apart)) <= ROUNDING * np.minimum(angle, 1.0)


@pytest.mark.parametrize("angle", ANGLES)
def test_equation_10_gives_the_rotation_back(angle):
    # The length of P is 2 sin(angle / 2), flat at pi: a rounding of P by eps moves the angle by
    # eps / cos(angle / 2), but never by more than sqrt(8 eps), where the clip to length 2 acts.
    v = angle * axes(50, 11)
    P = rotations.principal_axis(rotations.exp(v))
    flatness = min(1.0 / max(np.cos(angle / 2.0), 1e-300), EPS**-0.5)
    expected = Rotation.from_rotvec(v).as_matrix()
    found = matrix_from_principal_axis(P)
    assert found == pytest.approx(expected, abs=ROUNDING * flatness)


def test_equation_10_by_hand():
    quarter = matrix_from_principal_axis(np.array([0.0, 0.0, np.sqrt(2.0)]))
    assert quarter == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=ROUNDING)
    half = matrix_from_principal_axis(np.array([0.0, 2.0, 0.0]))
    assert half == pytest.approx(np.diag([-1.0, 1.0, -1.0]), abs=ROUNDING)


@law
@given(q=quaternions)
def test_law_rotations_are_orthogonal(q):
    R = rotations.matrix_from_quaternion(q)
    product = R @ R.T
    assert product == pytest.approx(np.eye(3), abs=ROUNDING)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=ROUNDING)


@law
@given(q=quaternions)
def test_law_exp_undoes_log(q):
    R = rotations.matrix_from_quaternion(q)
    assert rotations.exp(rotations.log(R)) == pytest.approx(R, abs=2 * ROUNDING)


@law
@given(v=vectors, q=quaternions)
def test_law_the_angle_does_not_depend_on_the_frame(v, q):
    R, S = rotations.exp(v), rotations.matrix_from_quaternion(q)
    assert rotations.angle(S @ R @ S.T) == pytest.approx(rotations.angle(R), abs=2 * ROUNDING)


@law
@given(v=vectors.filter(lambda v: np.linalg.norm(v) < 3.0))
def test_law_the_axis_of_the_inverse_is_opposite(v):
    R = rotations.exp(v)
    assert rotations.principal_axis(R.T) == pytest.approx(-rotations.principal_axis(R), abs=EPS)


@law
@given(v=vectors, w=vectors)
def test_law_the_angle_of_a_product_is_at_most_the_sum(v, w):
    R, S = rotations.exp(v), rotations.exp(w)
    longest = rotations.angle(R) + rotations.angle(S)
    assert rotations.angle(R @ S) <= longest + ROUNDING


def davenport(M: np.ndarray) -> np.ndarray:
    """The rotation with the largest tr(R' M), from the largest eigenvector of a 4x4 matrix."""
    z = np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]])
    K = np.zeros((4, 4))
    K[:3, :3] = M + M.T - np.trace(M) * np.eye(3)
    K[:3, 3] = K[3, :3] = z
    K[3, 3] = np.trace(M)
    return Rotation.from_quat(np.linalg.eigh(K)[1][:, -1]).as_matrix()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nearest_rotation_is_davenports(sign):
    M = np.random.default_rng(12).normal(size=(40, 3, 3))
    M *= (sign * np.sign(np.linalg.det(M)))[:, None, None]
    found = rotations.project_to_so3(M)
    assert np.linalg.det(found) == pytest.approx(np.ones(40), abs=4 * ROUNDING)
    for nearest, one in zip(found, M, strict=True):
        assert nearest == pytest.approx(davenport(one), abs=1e-11)
        if sign > 0:
            assert nearest == pytest.approx(polar(one)[0], abs=1e-11)


def test_nearest_rotation_beats_ten_thousand_others():
    M = np.random.default_rng(13).normal(size=(3, 3))
    M *= -np.sign(np.linalg.det(M))
    others = random_rotations((10_000,), 14)
    distance = np.linalg.norm(others - M, axis=(1, 2))
    least = np.linalg.norm(rotations.project_to_so3(M) - M)
    assert least <= distance.min() <= least + 0.1


def test_a_flat_matrix_has_a_nearest_rotation_too():
    M = np.diag([2.0, 1.0, 0.0])
    assert rotations.project_to_so3(M) == pytest.approx(np.eye(3), abs=ROUNDING)


def test_mean_is_scipys():
    middle = random_rotations((), 15)
    R = rotations.exp(0.4 * np.random.default_rng(16).normal(size=(30, 3))) @ middle
    expected = Rotation.from_matrix(R).mean().as_matrix()
    assert rotations.mean(R) == pytest.approx(expected, abs=2 * ROUNDING)


def test_mean_of_two_lies_half_way():
    v = np.array([0.3, -0.5, 0.2])
    pair = np.stack([np.eye(3), rotations.exp(v)])
    assert rotations.mean(pair) == pytest.approx(rotations.exp(v / 2), abs=ROUNDING)


@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.999e-2, 1.001e-2, 1.0, 3.0])
def test_left_jacobian_inverse_against_central_differences(angle):
    v = angle * axes(1, 17)[0]
    h = 1e-5
    d = h * np.eye(3)
    moved = [rotations.log(rotations.exp(side * d) @ rotations.exp(v)) for side in (1, -1)]
    numeric = ((moved[0] - moved[1]) / (2 * h)).T
    # Rounding / h = 1e-10; the third derivative times h^2 / 6 stays below that up to 3 rad.
    assert rotations.left_jacobian_inverse(v) == pytest.approx(numeric, abs=5e-10)


@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.999e-2, 1.001e-2, 1.0, 3.0, 4.5, 6.0])
def test_left_jacobian_inverse_inverts_the_integral_of_the_exponential(angle):
    v = angle * axes(1, 18)[0]
    block = np.zeros((6, 6))
    block[:3, :3], block[:3, 3:] = rotations.skew(v), np.eye(3)
    integral = expm(block)[:3, 3:]
    product = rotations.left_jacobian_inverse(v) @ integral
    assert product == pytest.approx(np.eye(3), abs=100 * EPS * np.linalg.cond(integral))


VECTORS = np.random.default_rng(19).normal(size=(2, 3, 4))
MATRICES = random_rotations((2, 3), 20)
KERNELS = {
    "skew": (rotations.skew, VECTORS[..., :3]),
    "exp": (rotations.exp, VECTORS[..., :3]),
    "log": (rotations.log, MATRICES),
    "angle": (rotations.angle, MATRICES),
    "matrix_from_quaternion": (rotations.matrix_from_quaternion, VECTORS),
    "quaternion_from_matrix": (rotations.quaternion_from_matrix, MATRICES),
    "principal_axis": (rotations.principal_axis, MATRICES),
    "matrix_from_euler": (lambda a: rotations.matrix_from_euler(a, "zyx"), VECTORS[..., :3]),
    "project_to_so3": (rotations.project_to_so3, MATRICES + 0.1),
    "left_jacobian_inverse": (rotations.left_jacobian_inverse, VECTORS[..., :3]),
}


@pytest.mark.parametrize("name", KERNELS)
def test_a_batch_is_a_loop(name):
    kernel, given_ = KERNELS[name]
    both = kernel(given_)
    for i in range(2):
        assert kernel(given_[i]) == pytest.approx(both[i], abs=ROUNDING)
        for j in range(3):
            assert kernel(given_[i, j]) == pytest.approx(both[i, j], abs=ROUNDING)


def test_a_batch_of_means_is_a_loop():
    both = rotations.mean(MATRICES)
    assert both.shape == (2, 3, 3)
    assert rotations.mean(MATRICES[1]) == pytest.approx(both[1], abs=ROUNDING)


@pytest.mark.parametrize("name", KERNELS)
def test_an_empty_batch_stays_empty(name):
    kernel, given_ = KERNELS[name]
    assert kernel(given_[:0, 0]).shape == kernel(given_[:, 0])[:0].shape


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
@pytest.mark.parametrize("count", [2, 3, 7])
def test_align_undoes_a_rotation(count, shape):
    rng = np.random.default_rng(34)
    R = random_rotations(shape, 34)
    sources = rng.normal(size=(*shape, count, 3))
    found = rotations.align(sources @ np.swapaxes(R, -1, -2), sources)
    assert found == pytest.approx(R, abs=1e-12)


def test_align_averages_noise_as_scipy_does():
    rng = np.random.default_rng(35)
    R = random_rotations((), 35)
    sources = rng.normal(size=(6, 3))
    targets = sources @ R.T + 1e-3 * rng.normal(size=(6, 3))
    found = rotations.align(targets, sources)
    normals = [np.cross(*targets[:2]), np.cross(*sources[:2])]
    expected, _ = Rotation.align_vectors(
        np.concatenate([targets, normals[:1]]), np.concatenate([sources, normals[1:]])
    )
    assert found == pytest.approx(expected.as_matrix(), abs=1e-10)
