"""The free directions against the null space of numerically differentiated loops."""

from __future__ import annotations

import numpy as np
import pytest
from degenerate_scenes import COUNTS, HIGH, LOW, NO_NOISE, degenerate, free_twists
from scenes import disturbed, general_scene, joint_covariance

from handeye_cli.geometry import se3
from handeye_cli.geometry.free_directions import (
    NOTHING_FREE,
    Freedom,
    complement,
    design_noise,
    feigned_information,
    fewest_free,
    free_directions,
)
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.whitened_loop import whiten
from handeye_cli.records import Noise

EXACT = [kind for kind in COUNTS if kind != "second axis in the noise"]


def found_free(A, B, perfect, covariance, least=(0, 0)):
    loops = whiten(loop_jacobians(A, B, perfect.X, perfect.Z), covariance)
    return free_directions(loops, covariance, A=A, X=perfect.X, B=B, least=least)


def null_space(perfect):
    """(k, 12) steps of X and Z that no residual notices, by central differences."""

    def residuals(step):
        X, Z = se3.perturb(perfect.X, step[:6]), se3.perturb(perfect.Z, step[6:])
        return se3.difference(perfect.A @ X @ perfect.B, Z).reshape(-1)

    h = 1e-5
    columns = [(residuals(h * e) - residuals(-h * e)) / (2 * h) for e in np.eye(12)]
    _, size, rows = np.linalg.svd(np.array(columns).T)
    return rows[np.concatenate([size, np.zeros(12 - len(size))]) < 1e-8]


@pytest.mark.parametrize("noise", [1e-9, 3e-4, 3e-3])
@pytest.mark.parametrize("kind", EXACT)
def test_held_directions_and_null_space_make_up_all_twelve(kind, noise):
    """Perfect poses: every null vector has a held component, and as many are held."""
    perfect = degenerate(kind, np.random.default_rng(1))
    covariance = joint_covariance(len(perfect.A), Noise(noise, noise, noise, noise))
    least = fewest_free(len(perfect.A))
    free = found_free(perfect.A, perfect.B, perfect, covariance, least)
    null = null_space(perfect)
    assert free.counts == COUNTS[kind]
    assert len(null) == sum(free.counts) == len(free_twists(perfect))
    together = np.concatenate([free.basis.T, null])
    assert np.linalg.svd(together, compute_uv=False)[-1] > 0.05


@pytest.mark.parametrize("kind", EXACT)
def test_free_translations_are_null_vectors_and_free_rotations_their_turns(kind):
    perfect = degenerate(kind, np.random.default_rng(2))
    covariance = joint_covariance(len(perfect.A), LOW)
    free = found_free(perfect.A, perfect.B, perfect, covariance, fewest_free(len(perfect.A)))
    null = null_space(perfect)
    turning = null[:, 3:6]
    for axis in free.rotations:
        fitted = turning.T @ np.linalg.lstsq(turning.T, axis, rcond=None)[0]
        np.testing.assert_allclose(fitted, axis, atol=1e-7)
    for direction in free.translations:
        step = np.concatenate([direction, np.zeros(3)])
        fitted = null[:, :6].T @ np.linalg.lstsq(null[:, :6].T, step, rcond=None)[0]
        np.testing.assert_allclose(fitted, step, atol=1e-7)


@pytest.mark.parametrize("kind", ["one axis", "scara"])
@pytest.mark.parametrize("noise", [LOW, HIGH])
def test_the_direction_is_found_as_well_as_its_noise_allows(kind, noise):
    """An axis seen by N turns of 0 to 1.5 rad is off by the robot's noise over their spread."""
    rng = np.random.default_rng(3)
    off = []
    for _ in range(60):
        perfect = degenerate(kind, rng)
        joint = joint_covariance(len(perfect.A), noise)
        A, B = (
            disturbed(rng, perfect.A, joint[:, :6, :6]),
            disturbed(rng, perfect.B, joint[:, 6:, 6:]),
        )
        free = found_free(A, B, perfect, joint)
        assert free.counts == COUNTS[kind]
        off.append(np.linalg.norm(np.cross(free.translations[0], perfect.axis)))
    # across an axis a turn's noise of sigma / sqrt(3) per axis is seen by angles spread by 0.49
    expected = noise.robot_rotation * np.sqrt(2.0 / 3.0) / (0.49 * np.sqrt(8))
    assert 0.6 * expected < np.sqrt(np.mean(np.square(off))) < 1.7 * expected


@pytest.mark.parametrize("kind", ["one axis", "translations", "identical poses"])
def test_noise_feigns_as_much_information_as_is_expected(kind):
    """Sampled: the ratio of the information in a free direction to its expectation is 1."""
    rng = np.random.default_rng(5)
    perfect = degenerate(kind, rng)
    joint = joint_covariance(len(perfect.A), LOW)
    exact = found_free(perfect.A, perfect.B, perfect, joint)
    steps = [np.concatenate([d, np.zeros(3)]) for d in exact.translations]
    if kind == "identical poses":
        steps += [np.concatenate([np.zeros(3), w]) for w in exact.rotations]
    ratios = []
    for _ in range(200):
        A = disturbed(rng, perfect.A, joint[:, :6, :6])
        B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
        loops = whiten(loop_jacobians(A, B, perfect.X, perfect.Z), joint)
        seen, by_Z = loops.design[..., :6].reshape(-1, 6), loops.design[..., 6:].reshape(-1, 6)
        along = np.concatenate([np.eye(6), -np.linalg.lstsq(by_Z, seen, rcond=None)[0]])
        left = loops.design.reshape(-1, 12) @ along
        moved = design_noise(loops.root, A=A, X=perfect.X, B=B) @ along
        feigned = feigned_information(moved, np.linalg.qr(by_Z)[0], joint)
        ratios.append([np.sum((left @ u) ** 2) / (u @ feigned @ u) for u in steps])
    # at least 14 degrees of freedom behind each ratio
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=5 * np.sqrt(2 / 14 / 200))


def test_the_design_moves_with_the_poses_as_differences_say():
    perfect = general_scene(np.random.default_rng(6), 3)
    root = np.tile(np.eye(6), (3, 1, 1))
    expected = design_noise(root, A=perfect.A, X=perfect.X, B=perfect.B)
    h = 1e-6
    for noise, step in enumerate(np.eye(12)[3:]):

        def design(size, step=step):
            A = se3.perturb(perfect.A, size * step[:6])
            B = se3.perturb(perfect.B, size * step[6:])
            return loop_jacobians(A, B, perfect.X, perfect.Z).by_unknowns

        moved = (design(h) - design(-h)) / (2 * h)
        np.testing.assert_allclose(moved, expected[:, noise], atol=1e-8)


@pytest.mark.parametrize("count", [3, 12])
@pytest.mark.parametrize("noise", [NO_NOISE, LOW, HIGH])
def test_two_axes_leave_nothing_free(count, noise):
    perfect = general_scene(np.random.default_rng(7), count)
    floored = Noise(*(max(level, 1e-9) for level in (noise.robot_rotation,) * 4))
    free = found_free(perfect.A, perfect.B, perfect, joint_covariance(count, floored))
    assert free.counts == (0, 0)
    np.testing.assert_array_equal(free.basis, np.eye(12))


def test_the_same_tilts_are_motion_at_little_noise_and_nothing_at_much():
    rng = np.random.default_rng(11)
    tilted = degenerate("second axis in the noise", rng, noise=Noise(1e-2, 0.0, 0.0, 0.0))
    for level, counts in ((1e-5, (0, 0)), (1e-2, (1, 1))):
        covariance = joint_covariance(len(tilted.A), Noise(level, level, level, level))
        assert found_free(tilted.A, tilted.B, tilted, covariance).counts == counts


def test_translations_settle_the_rotation_only_above_their_noise():
    perfect = degenerate("translations", np.random.default_rng(13))
    for level, counts in ((1e-4, (0, 3)), (0.3, (3, 3))):
        covariance = joint_covariance(len(perfect.A), Noise(1e-4, level, 1e-4, level))
        assert found_free(perfect.A, perfect.B, perfect, covariance).counts == counts


def test_what_is_free_in_any_case_is_the_weakest():
    perfect = degenerate("one axis", np.random.default_rng(17))
    tiny = joint_covariance(len(perfect.A), Noise(1e-9, 1e-9, 1e-9, 1e-9))
    tilted = se3.from_parts(np.eye(3), np.zeros((8, 3)))
    tilted[1::2, :3, :3] = [
        [1, 0, 0],
        [0, np.cos(0.1), -np.sin(0.1)],
        [0, np.sin(0.1), np.cos(0.1)],
    ]
    A = perfect.A @ tilted
    B = se3.inverse(perfect.X) @ se3.inverse(A) @ perfect.Z
    assert found_free(A, B, perfect, tiny).counts == (0, 0)
    forced = found_free(A, B, perfect, tiny, (0, 1))
    assert forced.counts == (0, 1)
    assert abs(forced.translations[0] @ perfect.axis) > np.cos(0.15)


def test_the_basis_is_orthonormal_and_holds_what_is_free():
    axis = np.array([[2.0, -1.0, 2.0]]) / 3.0
    basis = Freedom(axis, axis).basis
    assert basis.shape == (12, 10)
    np.testing.assert_allclose(basis.T @ basis, np.eye(10), atol=1e-15)
    np.testing.assert_allclose(axis @ basis[:3], 0.0, atol=1e-15)
    np.testing.assert_allclose(axis @ basis[3:6], 0.0, atol=1e-15)
    assert NOTHING_FREE.basis.shape == (12, 12)
    assert complement(np.eye(3)).shape == (3, 0)


@pytest.mark.parametrize(("count", "least"), [(1, (3, 3)), (2, (1, 1)), (3, (0, 0)), (9, (0, 0))])
def test_few_stations_leave_something_free_whatever_they_do(count, least):
    assert fewest_free(count) == least


def test_what_is_asked_about_stays_as_it_is():
    perfect = general_scene(np.random.default_rng(3), 5)
    covariance = joint_covariance(5, LOW)
    loops = whiten(loop_jacobians(perfect.A, perfect.B, perfect.X, perfect.Z), covariance)
    before = loops.design.copy()
    free_directions(loops, covariance, A=perfect.A, X=perfect.X, B=perfect.B)
    np.testing.assert_array_equal(loops.design, before)
