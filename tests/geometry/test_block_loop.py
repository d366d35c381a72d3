"""Fits to some stations against brute force: leaving out, predicting, several targets."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.block_loop import BlockFit, BlockLoops, fit, linearised, predicted
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.records import Noise

NOISE = Noise(1e-3, 3e-4, 1e-3, 2e-4)
MOVE = se3.from_parts(rotations.exp([0.1, -0.2, 0.05]), [0.02, 0.01, -0.03])

TRIALS = 120


def loops_of(rng, count, *, estimated=False, blocks=None):
    """Noisy stations, the second block of which sees the target moved; and the truth."""
    perfect = general_scene(rng, count)
    blocks = np.zeros(count, dtype=int) if blocks is None else blocks
    targets = np.array([np.eye(4), MOVE])[: blocks.max() + 1]
    joint = joint_covariance(count, NOISE)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    B = disturbed(rng, perfect.B @ targets[blocks], joint[:, 6:, 6:])
    shapes = np.zeros((0, count, 12, 12))
    if estimated:
        shapes = np.zeros((2, count, 12, 12))
        shapes[:, :, :6, :6] = [
            [isotropic_covariance(1.0, 0.0)] * count,
            [isotropic_covariance(0.0, 1.0)] * count,
        ]
        joint[:, :6] = 0.0
    Z = perfect.Z @ targets
    variances = np.array([1e-6, 1e-7])[: len(shapes)]
    start = BlockFit(
        perfect.X, Z, variances, np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0, 0))
    )
    return BlockLoops(A, B, joint, shapes, blocks), start


def test_one_block_is_the_loop_itself():
    loops, start = loops_of(np.random.default_rng(1), 6)
    linear = linearised(loops, start.X, start.Z)
    loop = loop_jacobians(loops.A, loops.B, start.X, start.Z[0])
    np.testing.assert_allclose(linear.residuals, loop.residuals, atol=1e-15)
    np.testing.assert_allclose(linear.design, loop.by_unknowns, atol=1e-14)
    np.testing.assert_allclose(linear.by_poses[..., 6:], loop.by_camera, atol=1e-14)


def test_design_of_two_blocks_against_differences():
    blocks = np.array([0, 1, 1, 0, 1])
    loops, start = loops_of(np.random.default_rng(2), 5, blocks=blocks)
    linear = linearised(loops, start.X, start.Z)
    for column in range(18):
        step = 1e-6 * np.eye(18)[column]
        ends = []
        for sign in (1.0, -1.0):
            X = se3.perturb(start.X, sign * step[:6])
            Z = se3.perturb(start.Z, sign * step[6:].reshape(2, 6))
            ends.append(se3.difference(loops.A @ X @ loops.B, Z[blocks]))
        slope = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(linear.design[..., column], slope, atol=1e-8)


def test_leading_axes_are_answers():
    loops, start = loops_of(np.random.default_rng(3), 5)
    X = np.array([start.X, se3.perturb(start.X, np.full(6, 0.01))])
    Z = np.array([start.Z, start.Z])
    both = linearised(loops, X, Z)
    for i in range(2):
        one = linearised(loops, X[i], Z[i])
        np.testing.assert_allclose(both.residuals[i], one.residuals, atol=1e-15)
        np.testing.assert_allclose(both.design[i], one.design, atol=1e-15)


def test_stations_inside_are_judged_as_if_left_out():
    loops, start = loops_of(np.random.default_rng(4), 7)
    everybody = np.ones(7, dtype=bool)
    _, distances = fit(loops, everybody, start, steps=4)
    for i in range(7):
        others = everybody.copy()
        others[i] = False
        found, _ = fit(loops, others, start, steps=4)
        alone = predicted(loops, found).squares[i]
        # both are of first order in the noise of 1e-3
        assert distances.squares[i] == pytest.approx(alone, rel=0.02)


def test_predicted_squares_are_chi_square_and_f():
    rng = np.random.default_rng(5)
    rows = np.arange(9) < 8
    known, chances = [], []
    for _ in range(TRIALS):
        loops, start = loops_of(rng, 9)
        known.append(fit(loops, rows, start)[1].squares[8])
        loops, start = loops_of(rng, 9, estimated=True)
        chances.append(fit(loops, rows, start)[1].chances()[8])
    # chi-square of six has the variance 12
    assert np.mean(known) == pytest.approx(6.0, abs=3.0 * np.sqrt(12.0 / TRIALS))
    # a uniform number's mean, and its lowest tenth
    assert np.mean(chances) == pytest.approx(0.5, abs=3.0 / np.sqrt(12.0 * TRIALS))
    assert np.mean(np.array(chances) < 0.1) == pytest.approx(0.1, abs=3.0 * np.sqrt(0.09 / TRIALS))


def test_a_move_of_the_target_is_recovered():
    blocks = np.repeat([0, 1], 5)
    loops, start = loops_of(np.random.default_rng(6), 10, blocks=blocks)
    rough = replace(start, Z=se3.perturb(start.Z, np.full((2, 6), 0.01)))
    found, _ = fit(loops, np.ones(10, dtype=bool), rough, steps=4)
    step = np.concatenate([np.zeros((6, 6)), -np.eye(6), np.eye(6)], axis=1)
    error = se3.difference(found.Z[1], found.Z[0]) - se3.difference(start.Z[1], start.Z[0])
    weighted = error @ np.linalg.solve(step @ found.covariance @ step.T, error)
    assert weighted < 22.5  # chi-square of six, 99.9 %


def test_what_no_station_determines_is_very_uncertain():
    loops, start = loops_of(np.random.default_rng(7), 6)
    rows = np.arange(6) < 1
    found, distances = fit(loops, rows, start)
    assert np.sqrt(found.covariance[3:6, 3:6].trace()) > 1.0
    assert distances.squares[1:].max() < 22.5  # nothing contradicts one station


def test_images_and_robot_poses_are_joined_with_their_noise():
    loops, _ = loops_of(np.random.default_rng(8), 4, estimated=True)
    joined = loops.paired(np.array([2, 0]), np.array([1, 3]))
    np.testing.assert_array_equal(joined.A, loops.A[[2, 0]])
    np.testing.assert_array_equal(joined.B, loops.B[[1, 3]])
    np.testing.assert_array_equal(joined.known[:, 6:, 6:], loops.known[[1, 3], 6:, 6:])
    np.testing.assert_array_equal(joined.shapes[:, :, :6, :6], loops.shapes[:, [2, 0], :6, :6])
