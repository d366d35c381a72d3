"""The 2N-station protocol against the paper's four steps written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, scene, stations
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.records import Noise
from handeye_cli.solve import solve
from handeye_cli.verify import verify, verify_calibration

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def four_steps(document, count, method, pairs):
    """Steps 2 - 4 of section IV-B with plain matrices, H_cg taken from the solver."""
    first = replace(document, stations=document.stations[:count])
    X = solve(first, method=method, pairs=pairs).mount_T_camera.matrix
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


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize(
    ("method", "pairs"),
    [("tsai-lenz", "star"), ("tsai-lenz", "all"), ("maximum-likelihood", "star")],
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


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("method", ["tsai-lenz", "maximum-likelihood"])
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


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("given", [True, False])
def test_good_data_are_consistent_and_worse_ones_are_not(setup, given):
    """One good recording in a hundred may be called inconsistent; tripled noise mostly is."""
    rng = np.random.default_rng(19)
    wrong_alarms = missed = 0
    for _ in range(60):
        perfect = general_scene(rng, 24)
        good = stations(rng, perfect, NOISE, setup=setup, given=given)
        (row,) = verify(good).rows
        wrong_alarms += not row.consistent
        loud = stations(rng, perfect, Noise(3e-3, 6e-4, 3e-3, 3e-4), setup=setup)
        mixed = good.stations[:12] + loud.stations[12:]
        (row,) = verify(replace(good, stations=mixed)).rows
        missed += bool(row.consistent)
    assert wrong_alarms <= 4
    assert missed <= 2
