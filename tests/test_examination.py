"""Stations are examined before they are solved: bad ones left out, contradictions told."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli import solvers
from handeye_cli.compare import compare
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.inspection import inspect
from handeye_cli.leave_one_out import leave_one_out
from handeye_cli.pipeline import Steps, to_calibration
from handeye_cli.records import Noise, PosePart, Stations, UncertainPose
from handeye_cli.render.console import make_console
from handeye_cli.render.report import show
from handeye_cli.solve import solve
from handeye_cli.solve_determined import solve_determined

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)
BAD = 4
ASIDE = se3.from_parts(np.eye(3), np.array([0.03, 0.0, 0.0]))


@pytest.fixture(params=Setup, scope="module")
def good(request):
    rng = np.random.default_rng(21)
    return stations(rng, general_scene(rng, 12), NOISE, setup=request.param)


def changed(document, robot=None, target=None):
    """The document with functions of the robot's poses and of (index, pose) of the target's."""
    rows = []
    for i, station in enumerate(document.stations):
        pose = station.camera_T_target
        if target is not None:
            pose = UncertainPose(target(i, pose.matrix), pose.covariance)
        matrix = station.base_T_gripper if robot is None else robot(station.base_T_gripper)
        rows.append(replace(station, base_T_gripper=matrix, camera_T_target=pose))
    return replace(document, stations=tuple(rows))


@pytest.fixture(scope="module")
def spoiled(good):
    return changed(good, target=lambda i, pose: pose @ ASIDE if i == BAD else pose)


@pytest.fixture(scope="module")
def one_axis(good):
    """Turns about the gripper's z axis, and translations across it and along it: SCARA."""
    rng = np.random.default_rng(22)
    turn = rotations.exp(np.outer(rng.uniform(-1.5, 1.5, 12), [0.0, 0.0, 1.0]))
    A = se3.from_parts(turn, rng.uniform(-0.3, 0.3, (12, 3)))
    X, Z = (se3.from_parts(rotations.exp(rng.normal(size=3)), rng.normal(size=3)) for _ in "XZ")
    B = se3.inverse(A @ X) @ Z
    robot = A if good.setup is Setup.EYE_IN_HAND else se3.inverse(A)
    rows = tuple(
        replace(station, base_T_gripper=robot[i], camera_T_target=UncertainPose(B[i]))
        for i, station in enumerate(good.stations)
    )
    return replace(good, stations=rows, noise=NOISE), X


def codes(found):
    return [finding.code for finding in found.diagnosis]


def test_a_bad_station_is_left_out_and_told(good, spoiled):
    found = solve(spoiled)
    rest = replace(good, stations=tuple(s for i, s in enumerate(good.stations) if i != BAD))
    alone = solve(rest)
    np.testing.assert_allclose(
        found.mount_T_camera.matrix, alone.mount_T_camera.matrix, rtol=0, atol=1e-9
    )
    assert "bad-station" in codes(found)
    unused = [row for row in found.stations if not row.used]
    assert [row.name for row in unused] == [good.stations[BAD].name]
    assert "the others contradict it" in unused[0].reason
    assert found.without.left_out == (unused[0].name,)
    assert found.without.translation > 5 * found.predicted_error.translation


def test_a_comparison_does_without_it_too(good, spoiled, monkeypatch):
    monkeypatch.setattr(solvers, "names", lambda: [solvers.DEFAULT, "shah"])
    row = next(row for row in compare(spoiled).comparison if row.method == "shah")
    rest = replace(good, stations=tuple(s for i, s in enumerate(good.stations) if i != BAD))
    alone = leave_one_out(rest, method="shah").rows[0]
    assert row.held_out_translation == pytest.approx(alone.translation, rel=1e-6)


def test_good_stations_are_all_used(good):
    found = solve(good)
    assert all(row.used for row in found.stations)
    assert found.without is None
    assert codes(inspect(good)) == []


def test_an_inspection_tells_what_a_solution_refuses(good):
    inverted = changed(good, robot=se3.inverse)
    with pytest.raises(UndeterminedError) as caught:
        solve(inverted)
    seen = inspect(inverted)
    assert [finding.message for finding in seen.errors] == [caught.value.message]
    assert seen.hypotheses[0].code == seen.errors[0].code == "mounting-or-direction"
    assert seen.predicted_error is None


def test_an_inspection_has_the_findings_and_the_error_of_the_solution(spoiled):
    seen, found = inspect(spoiled), solve(spoiled)
    assert seen.predicted_error == found.predicted_error
    assert seen.stations == found.stations
    assert set(codes(seen)) == set(codes(found))
    assert seen.blame is not None


def test_what_is_free_is_named_and_the_rest_answered(one_axis):
    document, X = one_axis
    seen = inspect(document)
    assert [finding.code for finding in seen.errors] == ["not-determined"]
    assert [each.part for each in seen.free] == [PosePart.TRANSLATION]
    found = solve_determined(document)
    (free,) = found.free
    assert abs(free.direction @ [0.0, 0.0, 1.0]) > 0.999
    np.testing.assert_allclose(found.mount_T_camera.matrix[:3, :3], X[:3, :3], atol=1e-6)
    np.testing.assert_allclose(found.mount_T_camera.matrix[:2, 3], X[:2, 3], atol=1e-6)
    assert "partly-determined" in codes(found)


def test_a_partial_answer_to_good_data_is_the_whole_one(good):
    whole, part = solve(good), solve_determined(good)
    np.testing.assert_array_equal(part.mount_T_camera.matrix, whole.mount_T_camera.matrix)
    assert part.free == ()


def test_stations_without_a_target_are_told(good):
    empty = replace(
        good, stations=tuple(replace(s, camera_T_target=None, reason="dark") for s in good.stations)
    )
    seen = inspect(empty)
    assert [finding.code for finding in seen.errors] == ["no-stations"]
    assert {row.reason for row in seen.stations} == {"dark"}


def test_partial_answers_are_not_compared(good):
    with pytest.raises(UsageError, match="--compare or --partial"):
        to_calibration(good, Steps(), method="shah", pairs="star", compare=True, partial=True)


def test_the_report_names_the_verdict_and_every_station(spoiled, tmp_path):
    path = tmp_path / "report.txt"
    with path.open("w") as stream:
        show(inspect(spoiled), make_console(stream))
    text = path.read_text()
    assert text.startswith("These data give an answer, with reservations")
    assert all(f"  {station.name} " in text for station in spoiled.stations)
    assert isinstance(spoiled, Stations)
