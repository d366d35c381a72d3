"""Simulated calibrations against a plain loop, a numerical Cramer-Rao bound and the paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulate.paper_setting import NOISE, PAPER

from handeye_cli import predict, solvers
from handeye_cli.api import solve_poses
from handeye_cli.chain import Chain
from handeye_cli.conventions import MIL
from handeye_cli.errors import ConvergenceError, UsageError
from handeye_cli.geometry import rotations, se3, star
from handeye_cli.records import Noise
from handeye_cli.simulate import trials as module
from handeye_cli.simulate.setting import Layout, layout_of
from handeye_cli.simulate.trials import (
    cramer_rao_bounds,
    draw,
    errors_of,
    paper_prediction,
    run_trials,
    simulate,
)


def test_the_base_setting_of_the_paper():
    """3.15 mrad and 27.1 mil; bounds of 2.90 mrad and 23.4 mil for one of the directions."""
    errors = simulate(PAPER, 4000, 2).errors
    assert errors.rotation_rms == pytest.approx(3.15e-3, abs=0.1e-3)
    assert errors.translation_rms == pytest.approx(27.1 * MIL, abs=1.5 * MIL)
    assert errors.rotation_rms < errors.rotation_max < 4 * errors.rotation_rms
    assert errors.translation_rms < errors.translation_max < 4 * errors.translation_rms
    layout, rng = layout_of(PAPER), np.random.default_rng(1)
    bounds = cramer_rao_bounds(draw(layout, PAPER, 500, rng), layout, PAPER)
    (low_rotation, low_translation), (high_rotation, high_translation) = (
        bounds.min(axis=0),
        bounds.max(axis=0),
    )
    assert low_rotation < 2.90e-3 < high_rotation
    assert low_translation < 23.4 * MIL < high_translation
    assert low_rotation < errors.bound.rotation < 2.90e-3
    assert low_translation < errors.bound.translation < 23.4 * MIL


@pytest.mark.parametrize(
    ("method", "pairs"),
    [("tsai-lenz", "star"), ("tsai-lenz", "all"), ("maximum-likelihood", "star")],
)
def test_the_batch_is_a_loop_over_solve_poses(method, pairs):
    setting = replace(PAPER, stations=6, method=method, pairs=pairs)
    layout = layout_of(setting)
    drawn = draw(layout, setting, 6, np.random.default_rng(3))
    found = errors_of(drawn, layout, setting)
    for robot, camera, X, errors in zip(
        drawn.base_T_gripper, drawn.camera_T_target, drawn.X, found, strict=True
    ):
        answer = solve_poses(robot, camera, method=method, pairs=pairs, noise=NOISE)
        apart = answer.mount_T_camera.matrix @ se3.inverse(X)
        shift = answer.mount_T_camera.matrix[:3, 3] - X[:3, 3]
        assert errors[0] == pytest.approx(rotations.angle(apart[:3, :3]), abs=1e-9)
        assert errors[1] == pytest.approx(np.linalg.norm(shift), abs=1e-9)


def test_the_loop_closes_and_only_noise_is_between_truth_and_measurement():
    layout = layout_of(replace(PAPER, stations=5))
    drawn = draw(layout, PAPER, 2000, np.random.default_rng(4))
    B = se3.inverse(layout.target_T_camera)
    closed = drawn.A @ drawn.X[:, None] @ B
    np.testing.assert_allclose(closed, np.broadcast_to(drawn.Z[:, None], closed.shape), atol=1e-12)
    measured = (
        se3.difference(drawn.base_T_gripper, drawn.A),
        se3.difference(drawn.camera_T_target, np.broadcast_to(B, drawn.A.shape)),
    )
    levels = (127e-6, 1.5e-3), (76.2e-6, 1.5e-3)
    for d, (translation, rotation) in zip(measured, levels, strict=True):
        sizes = np.sqrt(np.mean(np.sum(d.reshape(-1, 2, 3) ** 2, axis=-1), axis=0))
        # 30000 normal numbers tell their RMS to 0.4 %
        np.testing.assert_allclose(sizes, [translation, rotation], rtol=0.02)


def test_answers_are_drawn_from_all_directions():
    layout = layout_of(PAPER)
    X = draw(layout, PAPER, 4000, np.random.default_rng(5)).X
    np.testing.assert_allclose(np.linalg.norm(X[:, :3, 3], axis=1), PAPER.lever, rtol=1e-12)
    for vector in (X[:, :3, 3] / PAPER.lever, X[:, :3, 0], X[:, :3, 2]):
        assert np.all(np.abs(np.mean(vector, axis=0)) < 4 / np.sqrt(3 * 4000))
        np.testing.assert_allclose(np.mean(vector**2, axis=0), 1 / 3, atol=0.03)
    assert np.linalg.det(X[:, :3, :3]) == pytest.approx(np.ones(4000))


def numerical_bound(X, Z, B, noise):
    """Invert the information of all unknowns: X, Z and where each camera truly is."""
    count = len(B)
    sigma = np.repeat([noise.robot_translation, noise.robot_rotation], 3) / np.sqrt(3)
    sigma_c = np.repeat([noise.camera_translation, noise.camera_rotation], 3) / np.sqrt(3)

    def measured(v):
        X_v, Z_v = se3.perturb(X, v[:6]), se3.perturb(Z, v[6:12])
        B_v = se3.perturb(B, v[12:].reshape(count, 6))
        return Z_v @ se3.inverse(B_v) @ se3.inverse(X_v), B_v

    def column(k):
        step = np.zeros(12 + 6 * count)
        step[k] = 1e-6
        both = zip(measured(step), measured(-step), (sigma, sigma_c), strict=True)
        return np.concatenate([(se3.difference(a, b) / s / 2e-6).ravel() for a, b, s in both])

    J = np.stack([column(k) for k in range(12 + 6 * count)], axis=1)
    scale = np.linalg.norm(J, axis=0)
    root = np.linalg.inv(np.linalg.qr(J / scale, mode="r")) / scale[:, None]
    variance = np.sum(root**2, axis=1)[:6]
    return np.sqrt([variance[3:].sum(), variance[:3].sum()])


def test_the_bound_is_that_of_all_unknowns_together():
    setting = replace(PAPER, stations=5, noise=Noise(1e-3, 2e-4, 3e-3, 1e-4))
    layout = layout_of(setting)
    drawn = draw(layout, setting, 4, np.random.default_rng(6))
    bounds = cramer_rao_bounds(drawn, layout, setting)
    B = se3.inverse(layout.target_T_camera)
    for X, Z, found in zip(drawn.X, drawn.Z, bounds, strict=True):
        np.testing.assert_allclose(found, numerical_bound(X, Z, B, setting.noise), rtol=1e-5)


@pytest.mark.parametrize("stations", [3, 8])
def test_maximum_likelihood_attains_the_bound(stations):
    setting = replace(PAPER, stations=stations, method="maximum-likelihood")
    errors = simulate(setting, 2000, 7).errors
    # 2000 errors of three components each tell the ratio to 0.9 %
    assert errors.rotation_rms / errors.bound.rotation == pytest.approx(1.0, abs=0.03)
    assert errors.translation_rms / errors.bound.translation == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("method", solvers.names())
def test_every_method_finds_perfect_answers_and_none_beats_the_bound(method):
    quiet = simulate(replace(PAPER, method=method, noise=Noise(0.0, 0.0, 0.0, 0.0)), 50, 8).errors
    assert quiet.rotation_max < 1e-8
    assert quiet.translation_max < 1e-8
    noisy = simulate(replace(PAPER, method=method), 1000, 8).errors
    assert noisy.rotation_rms > 0.95 * noisy.bound.rotation
    assert noisy.translation_rms > 0.95 * noisy.bound.translation


def test_the_prediction_is_the_mean_over_the_directions():
    setting = replace(PAPER, stations=5)
    layout = layout_of(setting)
    drawn = draw(layout, setting, 400, np.random.default_rng(9))
    each = [one_prediction(A, layout) for A in drawn.A]
    expected = paper_prediction(layout, setting)
    assert [p.rotation for p in each] == pytest.approx([expected.rotation] * 400)
    assert [p.rotation_max for p in each] == pytest.approx([expected.rotation_max] * 400)
    rms = np.sqrt(np.mean([p.translation**2 for p in each]))
    assert rms == pytest.approx(expected.translation, rel=0.01)
    assert np.std([p.translation for p in each]) > 0.01 * rms  # else a mean would say nothing
    largest = np.mean([p.translation_max for p in each])
    assert largest == pytest.approx(expected.translation_max, rel=0.02)


def one_prediction(A, layout):
    count = len(A)
    chain = Chain(
        index=np.arange(count),
        A=A,
        B=se3.inverse(layout.target_T_camera),
        by_robot=np.tile(np.eye(6), (count, 1, 1)),
        camera_covariance=np.zeros((count, 6, 6)),
        has_covariance=False,
        by_intrinsics=np.zeros((count, 6, 0)),
    )
    sigmas = (5 * MIL, 1.5e-3, 3 * MIL, 1.5e-3)
    joint = np.diag(np.repeat(np.square(sigmas) / 3, 3))
    return predict.paper_prediction(chain, layout.pairs, np.tile(joint, (count, 1, 1)))


def test_blocks_of_trials_are_one_run_and_do_not_repeat_themselves(monkeypatch):
    layout, blocks = layout_of(PAPER), []
    monkeypatch.setattr(module, "_AT_ONCE", 30)

    def seen(*arguments):
        blocks.append(errors_of(*arguments))
        return blocks[-1]

    monkeypatch.setattr(module, "errors_of", seen)
    errors = run_trials(layout, PAPER, 25, np.random.default_rng(10))
    assert [len(block) for block in blocks] == [10, 10, 5]
    everything = np.concatenate(blocks)
    assert len(np.unique(everything[:, 0])) == 25
    assert errors.rotation_rms == pytest.approx(np.sqrt(np.mean(everything[:, 0] ** 2)))
    assert errors.translation_max == everything[:, 1].max()


def test_the_same_seed_gives_the_same_numbers():
    assert simulate(PAPER, 50, 11) == simulate(PAPER, 50, 11)
    assert simulate(PAPER, 50, 11).errors != simulate(PAPER, 50, 12).errors


def test_pairs_are_chosen_as_wanted():
    setting = replace(PAPER, stations=7)
    np.testing.assert_array_equal(layout_of(setting).pairs, star.star_pairs(7))
    np.testing.assert_array_equal(layout_of(replace(setting, pairs="all")).pairs, star.all_pairs(7))


def noisy(**levels):
    return {"noise": replace(NOISE, **levels)}


REFUSED = {
    "no trials": ({}, 0, 0, "1 to 100000 trials, found 0"),
    "too many": ({}, 100_001, 0, "found 100001"),
    "a negative seed": ({}, 1, -4, "at least 0, found -4"),
    "two stations": ({"stations": 2}, 1, 0, "3 to 1000 stations, found 2"),
    "many stations": ({"stations": 1001}, 1, 0, "stations, found 1001"),
    "no tilt": ({"tilt": 0.0}, 1, 0, "up to 80 deg, found 0 deg"),
    "edge on": ({"tilt": np.radians(81)}, 1, 0, "up to 80 deg, found 81 deg"),
    "far away": ({"distance": 200.0}, 1, 0, "a distance of 0 to 100 m, found 200 m"),
    "a negative lever": ({"lever": -0.1}, 1, 0, "a lever of 0 to 100 m, found -0.1 m"),
    "no number": ({"lever": float("nan")}, 1, 0, "found nan m"),
    "negative noise": (noisy(robot_translation=-1.0), 1, 0, "robot-translation noise .* -1 m"),
    "too noisy": (noisy(camera_rotation=1.5), 1, 0, "camera-rotation noise .* found 1.5 rad"),
    "no method": ({"method": "tsai"}, 1, 0, "found 'tsai'"),
    "no pairs": ({"pairs": "some"}, 1, 0, "found 'some'"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_cannot_be_simulated_is_refused(fault):
    changes, trials, seed, message = REFUSED[fault]
    with pytest.raises(UsageError, match=message):
        simulate(replace(PAPER, **changes), trials, seed)


@pytest.mark.parametrize(
    "changes",
    [{"tilt": np.radians(0.1)}, noisy(robot_rotation=0.5, camera_rotation=0.5)],
)
def test_a_method_that_does_not_settle_says_so(changes):
    setting = replace(PAPER, method="maximum-likelihood", **changes)
    with pytest.raises(ConvergenceError, match="maximum-likelihood did not settle in all of 200"):
        simulate(setting, 200, 0)


def test_a_layout_takes_the_place_of_the_settings_own():
    wide = layout_of(replace(PAPER, tilt=np.radians(60)))
    own = run_trials(layout_of(PAPER), PAPER, 200, np.random.default_rng(13))
    better = run_trials(
        Layout(wide.target_T_camera, wide.pairs), PAPER, 200, np.random.default_rng(13)
    )
    assert better.rotation_rms < 0.7 * own.rotation_rms
