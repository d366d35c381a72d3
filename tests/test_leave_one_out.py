"""Leave-one-out: its errors written out, its verdict against simulation and brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import real_recordings
from scenes import estimated, general_scene, scene, stations
from scipy.stats import chi2

from handeye_cli import leave_one_out
from handeye_cli.compat import opencv
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import rotations, se3
from handeye_cli.held_out import chance_of, held_out_errors
from handeye_cli.leave_one_out import leave_one_out as check_each
from handeye_cli.part_calibration import calibrate_part, noise_of_others, usable_chain
from handeye_cli.records import Noise, Protocol
from handeye_cli.solvers.station_mean import mean_target

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("method", ["tsai-lenz", "maximum-likelihood"])
def test_each_station_is_predicted_by_all_others(method, setup):
    rng = np.random.default_rng(1)
    document = stations(rng, general_scene(rng, 7), NOISE, setup=setup)
    found = check_each(document, method=method)
    (row,) = found.rows
    assert (found.protocol, row.stations) == (Protocol.LEAVE_ONE_OUT, 6)
    assert [each.name for each in row.errors] == [each.name for each in document.stations]
    chain = usable_chain(document)
    for i, error in enumerate(row.errors):
        others = np.delete(np.arange(7), i)
        rest = replace(document, stations=tuple(document.stations[k] for k in others))
        X = estimated(rest, method).solution.X
        Z = mean_target(chain.A[others], chain.B[others], X)
        apart = se3.difference(chain.A[i] @ X, Z @ se3.inverse(chain.B[i]))
        expected = [np.linalg.norm(apart[3:]), np.linalg.norm(apart[:3])]
        np.testing.assert_allclose([error.rotation, error.translation], expected, rtol=1e-6)
    assert row.rotation == pytest.approx(np.sqrt(np.mean([e.rotation**2 for e in row.errors])))


def covariance_of_all(document, method):
    """The (6 N, 6 N) covariance of the N errors from every station's influence on each of them."""
    chain = usable_chain(document)
    count = len(chain.A)
    moves, errors = np.zeros((count, 6, count, 12)), np.zeros((count, 6))
    for i in range(count):
        others = np.delete(np.arange(count), i)
        part = calibrate_part(
            chain.part(others), document, method=method, pairs="star", where="here"
        )
        one = held_out_errors(chain.part(np.array([i])), part.solution)
        moves[i][:, others] = np.einsum("ij,njk->ink", one.by_common[0], part.influence)
        moves[i][:, i] = one.by_poses[0]
        errors[i] = one.vectors[0]
    own = noise_of_others(chain, document.noise, Noise(), part.solution)
    return errors.ravel(), np.einsum("iajk,jkl,mbjl->iamb", moves, own, moves).reshape(
        6 * count, 6 * count
    )


@pytest.mark.parametrize("method", ["tsai-lenz", "maximum-likelihood"])
@pytest.mark.parametrize("layout", [scene, general_scene])
def test_all_errors_together_are_the_fit_to_all_stations(layout, method):
    """Their covariance has rank 6 N - 12, and weighs them as the docstring says."""
    rng = np.random.default_rng(2)
    document = stations(rng, layout(rng, 6), Noise(1e-4, 2e-5, 1e-4, 1e-5), given=True)
    errors, covariance = covariance_of_all(document, method)
    sigma = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / sigma[:, None] / sigma)
    assert values[11] < 1e-4 * values[12]
    squares = float(np.sum((vectors[:, 12:].T @ (errors / sigma)) ** 2 / values[12:]))
    found = leave_one_out._squares_of_all(document, usable_chain(document))
    assert found == pytest.approx(squares, rel=0.02)


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("method", "count", "given", "runs"),
    [("maximum-likelihood", 4, True, 120), ("tsai-lenz", 6, False, 40)],
)
def test_the_chances_of_good_recordings_are_evenly_spread(monkeypatch, method, count, given, runs):
    """So one good recording in a hundred is called inconsistent."""
    chances = []
    judge = leave_one_out._chance
    monkeypatch.setattr(
        leave_one_out, "_chance", lambda *a: chances.append(judge(*a)) or chances[-1]
    )
    rng = np.random.default_rng(3)
    seen, predicted = [], []
    for _ in range(runs):
        document = stations(rng, general_scene(rng, count), NOISE, given=given)
        (row,) = check_each(document, method=method).rows
        assert row.consistent == (chances[-1] > 0.01)
        seen.append([row.rotation, row.translation])
        predicted.append([row.predicted_rotation, row.predicted_translation])
    chances = np.array(chances)
    assert np.sum(chances < 0.01) <= 1 + 0.02 * runs
    assert 0.03 <= np.mean(chances < 0.1) <= 0.2
    ratio = np.sqrt(np.mean(np.square(seen), axis=0) / np.mean(np.square(predicted), axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)


@pytest.mark.parametrize("given", [True, False])
def test_a_station_that_does_not_belong_is_named(given):
    rng = np.random.default_rng(5)
    document = stations(rng, general_scene(rng, 10), NOISE, given=given)
    wrong = document.stations[3]
    moved = se3.perturb(wrong.base_T_gripper, np.array([0, 0, 0.02, 0.04, 0, 0]))
    entries = list(document.stations)
    entries[3] = replace(wrong, base_T_gripper=moved)
    found = check_each(replace(document, stations=tuple(entries)))
    assert found.rows[0].consistent is False
    (finding,) = found.diagnosis
    assert finding.code == "station-apart"
    assert 'station "03"' in finding.message


def test_noise_far_below_the_real_one_is_found_out_by_all_errors_together():
    rng = np.random.default_rng(7)
    missed = 0
    for _ in range(20):
        document = stations(rng, general_scene(rng, 8), NOISE)
        small = Noise(0.6e-3, 1.2e-4)
        missed += check_each(replace(document, noise=small)).rows[0].consistent is not False
    assert missed <= 14  # a third of the variance missing: not certain, but far from chance


def test_too_few_stations_are_refused():
    rng = np.random.default_rng(11)
    with pytest.raises(UndeterminedError, match=r"at least 4 usable stations.*found 3"):
        check_each(stations(rng, scene(rng, 3), NOISE))


def test_a_station_without_which_nothing_is_determined_is_named():
    rng = np.random.default_rng(13)
    perfect = scene(rng, 6)
    B = perfect.B.copy()
    about_x = np.linspace(0.0, 1.0, 5)[:, None] * np.array([1.0, 0.0, 0.0])
    B[:5, :3, :3] = rotations.exp(about_x)
    B[5, :3, :3] = rotations.exp(np.array([0.0, 0.6, 0.0]))
    A = perfect.Z @ se3.inverse(B) @ se3.inverse(perfect.X)
    with pytest.raises(UndeterminedError, match="two different axes") as caught:
        check_each(stations(rng, replace(perfect, A=A, B=B), NOISE))
    assert caught.value.where == 'leaving out station "05"'


def test_chances_are_those_of_the_distributions():
    np.testing.assert_allclose(chance_of(np.array([7.8, 11.3]), 3), chi2.sf([7.8, 11.3], 3))
    assert chance_of(3.29, 1, 1e7) == pytest.approx(chi2.sf(3.29, 1), rel=1e-5)
    assert chance_of(12.71**2, 1, 1.0) == pytest.approx(0.05, rel=1e-3)


def errors_of_opencv(document, name):
    """RMS of rotation and translation by one of OpenCV's methods, from the same target poses."""
    chain = usable_chain(document)
    count, errors = len(chain.A), []
    for i in range(count):
        others = np.delete(np.arange(count), i)
        A, B = chain.A[others], chain.B[others]
        method = getattr(opencv, f"CALIB_HAND_EYE_{name}")
        poses = A[:, :3, :3], A[:, :3, 3], B[:, :3, :3], B[:, :3, 3]
        R, t = opencv.calibrateHandEye(*poses, method=method)
        X = se3.from_parts(R, t.ravel())
        Z = mean_target(A, B, X)
        apart = se3.difference(chain.A[i] @ X, Z @ se3.inverse(chain.B[i]))
        errors.append([np.linalg.norm(apart[3:]), np.linalg.norm(apart[:3])])
    return np.sqrt(np.mean(np.square(errors), axis=0))


@real_recordings.ONE_PROCESS
@pytest.mark.parametrize("name", ["rct-10x10", "rct-charuco"])
def test_real_recordings_are_predicted_better_than_by_any_method_of_opencv(name):
    document = extrinsics(real_recordings.features(name), calibrate_intrinsics=True)
    (row,) = check_each(document).rows
    assert row.reprojection > 0
    for method in ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"):
        rotation, translation = errors_of_opencv(document, method)
        assert row.rotation <= rotation, method
        assert row.translation <= translation, method
