"""The time between images and poses of motions whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from moving_scenes import CAMERA, Run, X, Z

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.time_offset import MovingViews, angles_apart, estimate, rough_offset
from handeye_cli.geometry.trajectory import Trajectory

REACH = 1.0
GRID = 5e-3


def found(views):
    return estimate(views, rough_offset(views, REACH))


@pytest.mark.parametrize(
    ("setup", "offset"),
    [
        (Setup.EYE_IN_HAND, 0.038),
        (Setup.EYE_TO_HAND, -0.025),
        (Setup.EYE_IN_HAND, 0.0),
        (Setup.EYE_TO_HAND, 0.6),
    ],
)
def test_the_offset_is_found_within_its_sigma(setup, offset):
    run = Run(np.random.default_rng(int(1e3 * offset) % 97), setup, offset)
    views = run.moving_views()
    assert abs(rough_offset(views, REACH) - offset) <= GRID
    fit = found(views)
    assert fit.converged
    assert abs(fit.offset - offset) < 4 * fit.sigma < 1e-3
    for pose, truth, rows in ((fit.X, X, slice(0, 6)), (fit.Z, Z, slice(6, 12))):
        way = se3.difference(pose, truth)
        # chi-square of six degrees of freedom: 0.01 % are above 27.9
        assert way @ np.linalg.solve(fit.covariance[rows, rows], way) < 27.9


def test_exact_poses_give_the_exact_offset():
    """What is left is the way between samples, which is not quite straight: 1e-4 rad at 100 Hz."""
    fit = found(Run(np.random.default_rng(8), noise=1e-3).moving_views())
    assert fit.offset == pytest.approx(0.038, abs=5e-5)


def test_the_predicted_sigma_is_the_scatter():
    """Chi-square of 24 trials: 99.9 % of its values lie between 7.5 and 53.5."""
    trials = [Run(np.random.default_rng(k), jitter=2e-3, views=30) for k in range(24)]
    fits = [estimate(run.moving_views(), 0.04) for run in trials]
    errors = [(fit.offset - 0.038) / fit.sigma for fit in fits]
    assert 7.5 < np.sum(np.square(errors)) < 53.5
    # thirty of them tell a scatter to 13 %, 24 trials their mean to 3 %; X and Z take their part
    assert np.sqrt(np.mean([fit.variances[2] for fit in fits])) == pytest.approx(2e-3, rel=0.1)


@pytest.mark.parametrize("inverted", [False, True])
def test_the_robots_derivatives_are_central_differences(inverted):
    views = replace(Run(np.random.default_rng(3), noise=1e-6).moving_views(), inverted=inverted)
    # between samples a velocity is constant; over the window of 50 ms it is a mean
    step = 0.025
    _, by_pose, by_offset = views.robot(0.01)
    (ahead, _, _), (behind, _, _) = views.robot(0.01 + step), views.robot(0.01 - step)
    differences = se3.difference(ahead, behind) / (2 * step)
    np.testing.assert_allclose(by_offset, differences, atol=2e-3)
    moved = np.array([1e-6, -2e-6, 3e-6, 2e-6, 1e-6, -1e-6])
    path = replace(views.path, poses=se3.perturb(views.path.poses, moved))
    after, before = replace(views, path=path).robot(0.01)[0], views.robot(0.01)[0]
    np.testing.assert_allclose(se3.difference(after, before), by_pose @ moved, atol=1e-10)


def test_wrong_views_are_left_out():
    views = Run(np.random.default_rng(11)).moving_views()
    wrong = np.zeros(len(views.times), dtype=bool)
    wrong[[3, 11, 12, 25, 33]] = True
    turned = se3.perturb(views.B[wrong], np.random.default_rng(12).normal(0.0, 0.5, (5, 6)))
    B = views.B.copy()
    B[wrong] = turned
    fit = found(replace(views, B=B))
    assert fit.used.tolist() == (~wrong).tolist()
    assert abs(fit.offset - 0.038) < 4 * fit.sigma < 1e-3


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("wrong", [8, 14])
def test_a_third_of_wrong_views_does_no_harm(seed, wrong):
    views, rng = Run(np.random.default_rng(seed)).moving_views(), np.random.default_rng(9)
    rows = rng.permutation(40)[:wrong]
    B = views.B.copy()
    B[rows] = se3.perturb(B[rows], rng.normal(0.0, 0.5, (wrong, 6)))
    fit = found(replace(views, B=B))
    assert not fit.used[rows].any()
    assert np.count_nonzero(fit.used) == 40 - wrong
    assert abs(fit.offset - 0.038) < 4 * fit.sigma < 1e-3


def test_angles_apart_are_those_of_wrong_poses_and_other_times():
    views = Run(np.random.default_rng(4)).moving_views()
    right = angles_apart(views, 0.038)
    # the poses scatter by 0.1 and 0.2 mrad, the way between samples is off by 0.1 mrad
    assert right.max() < 2e-3
    assert np.median(angles_apart(views, 0.538)) > 50.0 * np.median(right)
    B = views.B.copy()
    B[7] = B[7] @ se3.from_parts(rotations.exp(np.array([0.6, 0.0, 0.0])), np.zeros(3))
    wrong = angles_apart(replace(views, B=B), 0.038)
    assert int(np.argmax(wrong)) == 7
    assert np.delete(wrong, 7).max() < 2e-3
    alone = angles_apart(replace(views, times=views.times - views.times[-1]), 0.0)
    assert np.isinf(alone).all()


def test_a_slow_estimation_is_given_time():
    """Fifteen views in 0.4 s: what the noise is and what the offset is settles slowly."""
    run = Run(np.random.default_rng(1))
    views, rng = run.moving_views(), np.random.default_rng(9)
    begin = views.times[10]
    times = np.linspace(begin, begin + 0.35, 15)
    path = views.path
    inside = (path.times > begin - 0.1) & (path.times < begin + 0.4)
    fits = []
    for _ in range(6):
        seen = se3.perturb(run.seen(times + 0.038), rng.normal(0.0, CAMERA, (15, 6)))
        short = MovingViews(
            Trajectory(path.times[inside], path.poses[inside]),
            inverted=False,
            times=times,
            B=seen,
            covariance=views.covariance[:15],
        )
        fits.append(estimate(short, 0.04))
    assert all(fit.converged for fit in fits)
    # chi-square of six, of which 99.9 % are below 22.5; they share the path's noise
    assert np.sum([((fit.offset - 0.038) / fit.sigma) ** 2 for fit in fits]) < 2 * 22.5


@pytest.mark.parametrize("seed", [0, 12, 34])
def test_a_search_that_leaves_the_path_finds_nothing(seed):
    """Where nothing moves, noise drives the offset to where no pose is known."""
    rng = np.random.default_rng(seed)
    run = Run(rng)
    path, begin = run.path(), 1.0 + 0.1 * seed
    inside = (path.times >= begin) & (path.times <= begin + 0.1)
    times = np.linspace(begin + 0.02, begin + 0.08, 12)
    still = se3.inverse(path.at(np.full(12, begin)) @ X) @ Z
    views = MovingViews(
        Trajectory(path.times[inside], path.poses[inside]),
        inverted=False,
        times=times,
        B=se3.perturb(still, rng.normal(0.0, 3.0 * CAMERA, (12, 6))),
        covariance=np.tile(np.diag((3.0 * CAMERA) ** 2), (12, 1, 1)),
    )
    fit = estimate(views, 0.0)
    assert fit is None or not fit.converged or fit.sigma > 0.02


def test_a_steady_turn_about_one_axis_tells_no_offset():
    """To be late by some time is to have the camera turned by some angle."""
    rng = np.random.default_rng(2)
    times = np.arange(0.0, 10.0, 0.01)
    turn = times[:, None] * np.array([0.0, 0.0, 0.3])
    poses = se3.perturb(
        se3.from_parts(rotations.exp(turn), np.zeros(3)), rng.normal(0.0, 1e-4, (1000, 6))
    )
    taken = np.linspace(1.0, 9.0, 30)
    now = rotations.exp(taken[:, None] * np.array([0.0, 0.0, 0.3]))
    B = se3.inverse(se3.from_parts(now, np.zeros(3)) @ X) @ Z
    B = se3.perturb(B, rng.normal(0.0, 1e-5, (30, 6)))
    covariance = np.tile(1e-10 * np.eye(6), (30, 1, 1))
    views = MovingViews(Trajectory(times, poses), False, taken, B, covariance)
    assert estimate(views, 0.0).sigma > 0.5


def test_views_outside_the_path_take_no_part():
    views = Run(np.random.default_rng(5)).moving_views()
    late = views.times > views.times[-6]
    end = views.times[-6] + 0.039
    inside = views.path.times < end
    path = Trajectory(views.path.times[inside], views.path.poses[inside])
    fit = found(replace(views, path=path))
    assert not fit.used[late].any()
    assert fit.used[~late].sum() >= 34
    assert abs(fit.offset - 0.038) < 4 * fit.sigma


def test_too_few_views_tell_nothing():
    views = Run(np.random.default_rng(6)).moving_views()
    few = np.arange(len(views.times)) < 4
    assert estimate(views.part(few), 0.0) is None


def test_a_path_elsewhere_gives_no_first_offset():
    views = Run(np.random.default_rng(7)).moving_views()
    assert rough_offset(replace(views, times=views.times + 100.0), REACH) == 0.0
