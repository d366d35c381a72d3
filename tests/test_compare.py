"""All methods side by side: against solutions of the parts one by one, and what fails."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import calibrated, estimated, general_scene, scene, stations

from handeye_cli import solvers
from handeye_cli.compare import compare
from handeye_cli.errors import ConvergenceError, UndeterminedError
from handeye_cli.geometry import rotations, se3
from handeye_cli.leave_one_out import leave_one_out
from handeye_cli.records import Noise, UncertainPose
from handeye_cli.solve import solve
from handeye_cli.solvers import Solution, li

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


@pytest.fixture(scope="module")
def document():
    rng = np.random.default_rng(3)
    return stations(rng, general_scene(rng, 8), NOISE)


@pytest.fixture(scope="module")
def compared(document):
    return compare(document, method="shah")


def row_of(calibration, method):
    (row,) = [row for row in calibration.comparison if row.method == method]
    return row


def test_the_answer_is_that_of_the_chosen_method(document, compared):
    alone = solve(document, method="shah")
    np.testing.assert_array_equal(compared.mount_T_camera.matrix, alone.mount_T_camera.matrix)
    assert compared.method == "shah"
    assert alone.comparison == ()


def test_every_method_has_a_row_and_maximum_likelihood_the_first(compared):
    methods = [row.method for row in compared.comparison]
    assert methods[0] == "maximum-likelihood"
    assert sorted(methods) == sorted(solvers.names())
    first = compared.comparison[0]
    assert (first.rotation, first.translation) == (0.0, 0.0)
    assert all(row.reason is None for row in compared.comparison)


@pytest.mark.parametrize("method", solvers.names())
def test_a_row_is_what_its_method_says_alone(document, compared, method):
    row, alone = row_of(compared, method), calibrated(document, method)
    best = estimated(document).solution.X
    apart = se3.difference(alone.mount_T_camera.matrix, best)
    assert row.rotation == pytest.approx(np.linalg.norm(apart[3:]), abs=1e-12)
    assert row.translation == pytest.approx(np.linalg.norm(apart[:3]), abs=1e-12)
    assert row.predicted_rotation == alone.predicted_error.rotation
    assert row.predicted_translation == alone.predicted_error.translation


@pytest.mark.parametrize("method", solvers.names())
def test_held_out_errors_are_those_of_calibrations_without_each_station(document, compared, method):
    errors = []
    for i, left_out in enumerate(document.stations):
        others = document.stations[:i] + document.stations[i + 1 :]
        X = estimated(replace(document, stations=others), method).solution.X
        A, B = (
            np.array([each.base_T_gripper for each in others]),
            np.array([each.camera_T_target.matrix for each in others]),
        )
        Z = se3.mean(A @ X @ B)
        by_camera = Z @ np.linalg.inv(left_out.camera_T_target.matrix)
        errors.append(se3.difference(left_out.base_T_gripper @ X, by_camera))
    translation, rotation = np.sqrt(np.mean(np.square(errors), axis=0).reshape(2, 3).sum(axis=1))
    row = row_of(compared, method)
    assert row.held_out_rotation == pytest.approx(rotation, rel=1e-6)
    assert row.held_out_translation == pytest.approx(translation, rel=1e-6)


@pytest.mark.parametrize("method", ["maximum-likelihood", "tsai-lenz", "li"])
def test_held_out_errors_are_those_of_verify(document, compared, method):
    row, seen = row_of(compared, method), leave_one_out(document, method=method).rows[0]
    assert row.held_out_rotation == pytest.approx(seen.rotation, rel=1e-9)
    assert row.held_out_translation == pytest.approx(seen.translation, rel=1e-9)


def test_three_stations_leave_nothing_to_hold_out():
    rng = np.random.default_rng(5)
    row = row_of(compare(stations(rng, scene(rng, 3), NOISE)), "park-martin")
    assert row.held_out_rotation is None
    assert row.predicted_rotation > 0
    assert row.reason == "no held-out error: expected at least 4 usable stations, found 3"


def test_a_station_that_nothing_is_determined_without_is_named():
    rng = np.random.default_rng(7)
    document = stations(rng, scene(rng, 6), NOISE)
    about_one_axis = rotations.exp(np.linspace(0, 1.5, 6)[:, None] * np.array([0.0, 0.0, 1.0]))
    gripper = se3.from_parts(about_one_axis, 0.1 * rng.normal(size=(6, 3)))
    gripper[4] = gripper[4] @ se3.from_parts(rotations.exp(np.array([0.6, 0.0, 0.0])), np.zeros(3))
    truth = scene(rng, 3)
    rows = tuple(
        replace(
            station,
            base_T_gripper=A,
            camera_T_target=UncertainPose(se3.inverse(truth.X) @ se3.inverse(A) @ truth.Z),
        )
        for station, A in zip(document.stations, gripper, strict=True)
    )
    answer = compare(replace(document, stations=rows))
    for row in answer.comparison:
        assert 'leaving out station "04": expected rotations about two different' in row.reason
        assert row.held_out_rotation is None


def test_a_method_that_fails_says_why_and_the_others_go_on(document, monkeypatch):
    def unsettled(problem):
        return Solution(np.eye(4), np.eye(4), converged=False)

    monkeypatch.setattr(li, "solve", unsettled)
    answer = compare(document)
    row = row_of(answer, "li")
    assert "the li estimation did not converge on 8 stations" in row.reason
    assert row.rotation is None
    assert row_of(answer, "shah").held_out_rotation > 0
    with pytest.raises(ConvergenceError, match="the li estimation"):
        compare(document, method="li")


def test_what_no_method_can_answer_is_an_error(document):
    with pytest.raises(UndeterminedError, match="found 2 of 2"):
        compare(replace(document, stations=document.stations[:2]))
