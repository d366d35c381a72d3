"""The 2N-station protocol against the paper's four steps written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import calibrated, disturbed, estimated, general_scene, scene, stations
from scipy.spatial.transform import Rotation

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import camera, se3
from handeye_cli.records import (
    Camera,
    Features,
    Noise,
    Observation,
    Protocol,
    Station,
    TargetSpec,
)
from handeye_cli.solve import solve
from handeye_cli.verify import verify, verify_calibration

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)
BOARD = TargetSpec("chessboard", {"columns": 9, "rows": 6, "square_mm": 20.0})


def four_steps(document, count, method, pairs):
    """Steps 2 - 4 of section IV-B with plain matrices, H_cg taken from the solver."""
    first = replace(document, stations=document.stations[:count])
    X = estimated(first, method, pairs).solution.X
    hand = document.setup is Setup.EYE_IN_HAND
    G = [s.base_T_gripper if hand else np.linalg.inv(s.base_T_gripper) for s in document.stations]
    C = [s.camera_T_target.matrix for s in document.stations]
    H_RC = [np.linalg.inv(g @ X @ c) for g, c in zip(G[:count], C[:count], strict=True)]
    mean = np.eye(4)
    mean[:3, :3] = Rotation.from_matrix([H[:3, :3] for H in H_RC]).mean().as_matrix()
    mean[:3, 3] = np.mean([H[:3, 3] for H in H_RC], axis=0)
    rows = []
    for k in range(count, 2 * count):
        by_robot = G[k] @ X
        by_camera = np.linalg.inv(C[k] @ mean)
        turn = Rotation.from_matrix(by_robot[:3, :3].T @ by_camera[:3, :3]).magnitude()
        rows.append([turn, np.linalg.norm(by_robot[:3, 3] - by_camera[:3, 3])])
    return np.array(rows)


@pytest.mark.parametrize(
    ("method", "pairs", "setup"),
    [
        ("tsai-lenz", "star", Setup.EYE_IN_HAND),
        ("tsai-lenz", "all", Setup.EYE_TO_HAND),
        ("maximum-likelihood", "star", Setup.EYE_TO_HAND),
        ("maximum-likelihood", "star", Setup.EYE_IN_HAND),
    ],
)
def test_rows_are_the_papers_steps(method, pairs, setup):
    rng = np.random.default_rng(3)
    document = stations(rng, general_scene(rng, 24), NOISE, setup=setup)
    counts = [4, 6, 8, 10, 12]
    found = verify(document, counts=counts, method=method, pairs=pairs)
    assert [row.stations for row in found.rows] == counts
    for row in found.rows:
        expected = four_steps(document, row.stations, method, pairs)
        rms = np.sqrt(np.mean(expected**2, axis=0))
        assert row.rotation == pytest.approx(rms[0], rel=0.005)
        assert row.translation == pytest.approx(rms[1], rel=0.005)
        assert [e.name for e in row.errors] == [
            s.name for s in document.stations[row.stations : 2 * row.stations]
        ]
        np.testing.assert_allclose(
            [[e.rotation, e.translation] for e in row.errors], expected, rtol=0.02, atol=1e-5
        )


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("method", "setup"),
    [("tsai-lenz", Setup.EYE_TO_HAND), ("maximum-likelihood", Setup.EYE_IN_HAND)],
)
def test_seen_errors_are_the_predicted_ones(setup, method):
    rng = np.random.default_rng(5)
    seen, predicted = [], []
    for _ in range(60):
        document = stations(rng, general_scene(rng, 16), NOISE, setup=setup, given=True)
        (row,) = verify(document, method=method).rows
        seen.append([row.rotation, row.translation])
        predicted.append([row.predicted_rotation, row.predicted_translation])
    ratio = np.sqrt(np.mean(np.square(seen), axis=0) / np.mean(np.square(predicted), axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)


def test_half_of_the_usable_stations_is_the_default():
    rng = np.random.default_rng(7)
    document = stations(rng, scene(rng, 9), NOISE)
    assert [row.stations for row in verify(document).rows] == [4]


def test_too_few_stations_are_refused():
    rng = np.random.default_rng(11)
    with pytest.raises(UndeterminedError, match=r"at least 6 usable stations.*found 5"):
        verify(stations(rng, scene(rng, 5), NOISE))


@pytest.mark.parametrize("count", [2, 6])
def test_counts_out_of_range_are_refused(count):
    rng = np.random.default_rng(13)
    with pytest.raises(UsageError, match=f"between 3 and 5.*10 usable stations, found {count}"):
        verify(stations(rng, scene(rng, 10), NOISE), counts=[4, count])


def test_a_calibration_is_checked_on_new_stations():
    rng = np.random.default_rng(17)
    perfect = general_scene(rng, 20)
    old = stations(rng, perfect, NOISE)
    calibration = solve(replace(old, stations=old.stations[:10]))
    (row,) = verify_calibration(replace(old, stations=old.stations[10:]), calibration).rows
    assert row.stations == 10
    assert len(row.errors) == 10
    assert 5e-4 < row.rotation < 4e-3
    assert 1e-4 < row.translation < 2e-3
    wrong = replace(old, setup=Setup.EYE_TO_HAND)
    with pytest.raises(UsageError, match="eye-in-hand, found eye-to-hand"):
        verify_calibration(wrong, calibration)


def moved(document, matrix):
    """The same recording with its target at another place."""
    shifted = [
        replace(each, camera_T_target=replace(each.camera_T_target, matrix=seen @ matrix))
        for each in document.stations
        for seen in [each.camera_T_target.matrix]
    ]
    return replace(document, stations=tuple(shifted))


def halves(document, count):
    first, second = document.stations[:count], document.stations[count:]
    return replace(document, stations=first), replace(document, stations=second)


MOVE = se3.perturb(np.eye(4), np.array([0.03, -0.02, 0.01, 0.02, 0.05, -0.03]))


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("given", "target_moved", "setup"),
    [
        (True, False, Setup.EYE_IN_HAND),
        (True, True, Setup.EYE_TO_HAND),
        (False, False, Setup.EYE_TO_HAND),
        (False, True, Setup.EYE_IN_HAND),
    ],
)
def test_errors_of_an_existing_calibration_are_the_predicted_ones(given, target_moved, setup):
    rng = np.random.default_rng(23)
    seen, predicted, alarms = [], [], 0
    for _ in range(60):
        document = stations(rng, scene(rng, 16), NOISE, setup=setup, given=given)
        old, new = halves(document, 8)
        new = moved(new, MOVE) if target_moved else new
        found = verify_calibration(new, calibrated(old), target_moved=target_moved)
        (row,) = found.rows
        alarms += not row.consistent
        seen.append([row.rotation, row.translation])
        predicted.append([row.predicted_rotation, row.predicted_translation])
    ratio = np.sqrt(np.mean(np.square(seen), axis=0) / np.mean(np.square(predicted), axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)
    assert alarms <= 3
    assert found.protocol is (Protocol.MOVED_TARGET if target_moved else Protocol.CALIBRATION)


def test_a_target_that_was_moved_is_found_out():
    rng = np.random.default_rng(29)
    old, new = halves(stations(rng, general_scene(rng, 20), NOISE), 10)
    calibration = solve(old)
    new = moved(new, MOVE)
    found = verify_calibration(new, calibration)
    (row,) = found.rows
    assert row.consistent is False
    assert row.translation > 0.02
    (finding,) = found.diagnosis
    assert finding.code == "target-moved"
    assert "--target-moved" in finding.advice
    found = verify_calibration(new, calibration, target_moved=True)
    assert found.rows[0].consistent is True
    assert found.rows[0].translation < 2e-3
    (finding,) = found.diagnosis
    distance = np.linalg.norm(MOVE[:3, 3]) * 1e3
    assert finding.code == "target-placed-anew"
    assert float(finding.message.split(": ")[1].split()[0]) == pytest.approx(distance, abs=2.0)


def test_a_larger_noise_is_not_taken_for_a_moved_target():
    rng = np.random.default_rng(31)
    perfect = general_scene(rng, 20)
    old, _ = halves(stations(rng, perfect, NOISE), 10)
    _, new = halves(stations(rng, perfect, Noise(5e-3, 1e-3, 1e-3, 1e-4)), 10)
    found = verify_calibration(new, solve(old))
    assert found.rows[0].consistent is False
    assert found.diagnosis == ()


def test_without_the_covariance_between_the_poses_the_prediction_is_too_wide_and_says_so():
    rng = np.random.default_rng(37)
    ratios = []
    for _ in range(10):
        old, new = halves(stations(rng, scene(rng, 16), NOISE), 8)
        calibration = calibrated(old)
        joint = verify_calibration(new, calibration)
        apart = verify_calibration(new, replace(calibration, covariance_between=None))
        rows = apart.rows[0], joint.rows[0]
        ratios.append([rows[0].predicted_rotation / rows[1].predicted_rotation])
        assert [finding.code for finding in apart.diagnosis] == ["covariance-incomplete"]
    assert np.min(ratios) > 1.0


def test_a_calibration_without_covariances_predicts_nothing():
    rng = np.random.default_rng(41)
    old, new = halves(stations(rng, general_scene(rng, 12), NOISE), 6)
    calibration = solve(old)
    bare = replace(calibration.mount_T_camera, covariance=None)
    (row,) = verify_calibration(new, replace(calibration, mount_T_camera=bare)).rows
    assert (row.consistent, row.predicted_rotation, row.predicted_translation) == (None,) * 3


def test_intrinsics_that_were_refined_are_those_new_stations_are_seen_through():
    rng = np.random.default_rng(43)
    points = targets.build(BOARD).points()
    perfect = general_scene(rng, 12)
    true = np.array([800.0, 800.0, 320.0, 240.0])
    joint = np.diag(np.repeat([1e-4, 2e-4], 3) ** 2)
    robot = disturbed(rng, perfect.A, np.tile(joint, (12, 1, 1)))
    recorded = []
    for index, (A, B) in enumerate(zip(robot, perfect.B, strict=True)):
        pixels = camera.project(se3.transform_points(B, points), true)
        seen = Observation(np.arange(len(points)), pixels + 0.05 * rng.normal(size=pixels.shape))
        recorded.append(Station(f"{index:02d}", A, seen))
    wrong = Camera(
        640, 480, 812.0, 812.0, 320.0, 240.0, covariance=np.diag([144.0] * 2 + [9.0] * 2)
    )
    features = Features(Setup.EYE_IN_HAND, tuple(recorded), BOARD, camera=wrong)
    old, new = halves(extrinsics(features), 6)
    calibration = solve(old)
    assert abs(calibration.camera.fx - 800.0) < 3.0
    (row,) = verify_calibration(new, calibration).rows
    exact = replace(calibration, camera=replace(calibration.camera, covariance=None))
    (through_the_wrong,) = verify_calibration(new, exact).rows
    assert row.translation < 0.3 * through_the_wrong.translation
    assert row.consistent is True


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("setup", "given"), [(Setup.EYE_IN_HAND, True), (Setup.EYE_TO_HAND, False)]
)
def test_good_data_are_consistent_and_worse_ones_are_not(setup, given):
    """One good recording in a hundred may be called inconsistent; tripled noise mostly is."""
    rng = np.random.default_rng(19)
    wrong_alarms = missed = 0
    for run in range(60):
        perfect = general_scene(rng, 24)
        good = stations(rng, perfect, NOISE, setup=setup, given=given)
        (row,) = verify(good).rows
        wrong_alarms += not row.consistent
        if run >= 20:
            continue
        loud = stations(rng, perfect, Noise(3e-3, 6e-4, 3e-3, 3e-4), setup=setup)
        mixed = good.stations[:12] + loud.stations[12:]
        (row,) = verify(replace(good, stations=mixed)).rows
        missed += bool(row.consistent)
    assert wrong_alarms <= 4
    assert missed <= 1
