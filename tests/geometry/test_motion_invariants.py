"""The fits of many readings at once: the truth, brute force, bad stations, symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, scene, unit
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.motion_invariants import (
    fit_rotations,
    fit_translations,
    pair_angles,
    second_turn,
    turned_answers,
)
from handeye_cli.records import Noise

NOISE = Noise(2e-3, 1e-3, 2e-3, 1e-3)


def noisy(rng, perfect, noise=NOISE):
    joint = joint_covariance(len(perfect.A), noise)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    return A, disturbed(rng, perfect.B, joint[:, 6:, 6:])


def fitted(A, B, keep=None):
    mask = np.ones(A.shape[:-2], dtype=bool)
    keep = np.full(A.shape[:-3], A.shape[-3] if keep is None else keep)
    turned = fit_rotations(A[..., :3, :3], B[..., :3, :3], mask, keep)
    return turned, fit_translations(A, B, turned, mask, keep)


@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [3, 4, 8])
def test_perfect_stations_leave_nothing(layout, count):
    perfect = layout(np.random.default_rng(count), count)
    turned, moved = fitted(perfect.A, perfect.B)
    np.testing.assert_allclose(turned.R_X, perfect.X[:3, :3], atol=1e-9)
    np.testing.assert_allclose(turned.R_Z, perfect.Z[:3, :3], atol=1e-9)
    np.testing.assert_allclose(moved.t_X, perfect.X[:3, 3], atol=1e-8)
    np.testing.assert_allclose(moved.t_Z, perfect.Z[:3, 3], atol=1e-8)
    assert max(turned.rms, moved.rms, moved.apart) < 1e-8


def test_the_residual_of_the_rotations_is_the_least_there_is():
    rng = np.random.default_rng(1)
    A, B = noisy(rng, general_scene(rng, 9))
    turned, _ = fitted(A, B)

    def angles(v):
        R_X, R_Z = rotations.exp(v.reshape(2, 3)) @ np.stack([turned.R_X, turned.R_Z])
        loops = np.swapaxes(A[:, :3, :3] @ R_X @ B[:, :3, :3], -1, -2) @ R_Z
        return Rotation.from_matrix(loops).as_rotvec().ravel()

    best = least_squares(angles, np.zeros(6)).fun.reshape(-1, 3)
    least = np.sqrt(np.mean(np.sum(best**2, axis=1)))
    # the linear equations weigh no direction wrongly, so almost nothing is left to gain
    assert least <= turned.rms <= 1.02 * least


def test_the_translations_are_those_of_least_squares():
    rng = np.random.default_rng(2)
    A, B = noisy(rng, general_scene(rng, 9))
    turned, moved = fitted(A, B)
    turned_t = B[:, :3, 3] @ turned.R_X.T
    rows = np.concatenate([A[:, :3, :3], np.tile(-np.eye(3), (9, 1, 1))], axis=2).reshape(-1, 6)
    right = -(A[:, :3, 3] + np.einsum("nij,nj->ni", A[:, :3, :3], turned_t)).ravel()
    found, squares, *_ = np.linalg.lstsq(rows, right, rcond=None)
    np.testing.assert_allclose(np.concatenate([moved.t_X, moved.t_Z]), found, atol=1e-9)
    assert moved.apart == pytest.approx(np.sqrt(squares[0] / 9), rel=1e-9)


@pytest.mark.parametrize("factor", [1e-3, 0.8, 1.0, 1e3])
def test_the_ratio_of_lengths_is_found_and_units_do_not_matter(factor):
    rng = np.random.default_rng(3)
    A, B = noisy(rng, general_scene(rng, 12))
    _, plain = fitted(A, B)
    A[:, :3, 3] *= factor
    _, moved = fitted(A, B)
    assert moved.ratio == pytest.approx(factor * plain.ratio, rel=1e-9)
    assert moved.ratio == pytest.approx(factor, rel=0.02)
    assert moved.correlation == pytest.approx(plain.correlation, abs=1e-12)
    assert moved.rms / moved.reach == pytest.approx(plain.rms / plain.reach, rel=1e-9)


def test_a_circle_about_the_target_does_not_tell_the_ratio():
    perfect = scene(np.random.default_rng(4), 8)
    perfect.A[:, :3, 3] *= 1000.0
    _, moved = fitted(perfect.A, perfect.B)
    assert moved.apart < 1e-9
    assert np.linalg.norm(moved.t_X) > 100.0


def test_two_bad_stations_of_eight_change_nothing():
    rng = np.random.default_rng(5)
    for _ in range(20):
        A, B = noisy(rng, general_scene(rng, 8))
        good, bad = np.arange(2, 8), np.arange(2)
        alone, alone_moved = fitted(A[good], B[good])
        A[bad] = se3.perturb(A[bad], 0.5 * rng.normal(size=(2, 6)))
        turned, moved = fitted(A, B, keep=6)
        np.testing.assert_array_equal(turned.kept, np.arange(8) >= 2)
        np.testing.assert_allclose(turned.R_X, alone.R_X, atol=1e-9)
        assert turned.rms == pytest.approx(alone.rms, rel=1e-9)
        assert moved.rms == pytest.approx(alone_moved.rms, rel=1e-9)


def test_batches_are_loops_and_masked_stations_are_not_there():
    rng = np.random.default_rng(6)
    sides = np.array([noisy(rng, general_scene(rng, 7)) for _ in range(6)])
    A, B = np.moveaxis(sides.reshape(2, 3, 2, 7, 4, 4), 2, 0)
    mask = rng.random((2, 3, 7)) < 0.8
    keep = np.sum(mask, axis=-1) - 1
    turned = fit_rotations(A[..., :3, :3], B[..., :3, :3], mask, keep)
    moved = fit_translations(A, B, turned, mask, keep)
    for at in np.ndindex(2, 3):
        there = mask[at]
        R_A, R_B = A[at][there], B[at][there]
        one = fit_rotations(R_A[:, :3, :3], R_B[:, :3, :3], there[there], keep[at])
        other = fit_translations(R_A, R_B, one, there[there], keep[at])
        assert turned.rms[at] == pytest.approx(one.rms, rel=1e-6)
        assert moved.rms[at] == pytest.approx(other.rms, rel=1e-6)
        np.testing.assert_allclose(turned.residuals[at][there], one.residuals, rtol=1e-6)
        assert np.isinf(turned.residuals[at][~there]).all()


def test_half_turns_between_stations_are_as_good_as_any():
    rng = np.random.default_rng(7)
    perfect = general_scene(rng, 8)
    camera = se3.inverse(perfect.B)
    camera[1::2, :3, :3] = camera[::2, :3, :3] @ np.diag([-1.0, -1.0, 1.0])
    A = perfect.Z @ camera @ se3.inverse(perfect.X)
    angles = pair_angles(A[:, :3, :3])[::2, 1::2].diagonal()
    np.testing.assert_allclose(angles, np.pi, atol=1e-7)
    turned, moved = fitted(A, se3.inverse(camera))
    np.testing.assert_allclose(turned.R_X, perfect.X[:3, :3], atol=1e-9)
    assert max(turned.rms, moved.rms) < 1e-8


def test_quaternions_in_the_wrong_order_turn_as_the_inverse_does():
    """A cyclic change of the four numbers is a reflection, and so is the conjugate."""
    rng = np.random.default_rng(8)
    perfect = general_scene(rng, 8)
    q = Rotation.from_matrix(perfect.A[:, :3, :3]).as_quat()
    A = se3.from_parts(Rotation.from_quat(np.roll(q, 1, axis=1)).as_matrix(), perfect.A[:, :3, 3])
    wrong, _ = fitted(A, perfect.B)
    turned, moved = fitted(se3.inverse(A), perfect.B)
    assert wrong.rms > 0.1
    assert turned.rms < 1e-8
    assert moved.rms > 0.1 * moved.reach


def test_pair_angles_are_those_of_both_sides():
    rng = np.random.default_rng(9)
    perfect = general_scene(rng, 6)
    turns = Rotation.from_matrix(perfect.A[:, :3, :3])
    expected = [[(one.inv() * other).magnitude() for other in turns] for one in turns]
    found = pair_angles(np.stack([perfect.A, perfect.B])[..., :3, :3])
    np.testing.assert_allclose(found, [expected, expected], atol=1e-7)


def test_rotations_about_one_axis_turn_across_none():
    rng = np.random.default_rng(10)
    start, axis = rotations.exp(rng.normal(size=3)), unit(rng)
    about = rotations.exp(rng.uniform(-3.0, 3.0, (10, 1)) * axis)
    everyone = np.ones(10, dtype=bool)
    assert second_turn(start @ about, everyone) < 1e-7
    across = np.cross(axis, unit(rng))
    across *= 0.05 / np.linalg.norm(across)
    small = rotations.exp(np.where(np.arange(10) % 2, 1.0, -1.0)[:, None] * across)
    assert second_turn(start @ about @ small, everyone) == pytest.approx(0.05, rel=0.3)


@pytest.mark.parametrize("axes", ["xy", "xyz"])
def test_half_turns_allow_other_rotations_that_are_all_found(axes):
    """About two axes, and not across, two answers fit; about three that are across, four."""
    rng = np.random.default_rng(7)
    frame = rotations.exp(rng.normal(size=3))
    x, y, z = frame.T
    aside = {"xy": [x, np.cos(0.7) * x + np.sin(0.7) * y], "xyz": [x, y, z]}[axes]
    turns = np.array([np.eye(3), *rotations.exp(np.pi * np.array(aside))])
    R_X, R_Z = rotations.exp(rng.normal(size=(2, 3)))
    start = rotations.exp(rng.normal(size=3))
    A = (start @ turns)[None]
    B = (np.swapaxes(A @ R_X, -1, -2) @ R_Z) @ rotations.exp(1e-4 * rng.normal(size=A.shape[:-1]))
    mask, keep = np.ones(A.shape[:2], dtype=bool), np.array([A.shape[1]])
    found = fit_rotations(A, B, mask, keep)
    others = turned_answers(A, B, found, mask, keep)
    together = np.concatenate([found.R_X[:, None], others.R_X], axis=1)[0]
    fitting = together[np.append(found.rms, others.rms) < 1e-3]
    expected = {"xy": [z], "xyz": [x, y, z]}[axes]
    wanted = np.concatenate([R_X[None], rotations.exp(np.pi * np.array(expected)) @ R_X])
    apart = rotations.angle(wanted[:, None] @ np.swapaxes(fitting, -1, -2))
    assert apart.min(axis=1).max() < 1e-3
    assert apart.min(axis=0).max() < 1e-3
