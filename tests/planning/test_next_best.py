"""Stations to add to a recording: what they are worth, and whether they keep that promise."""

from dataclasses import replace
from itertools import pairwise
from statistics import NormalDist

import numpy as np
import pytest
import scenes
from moving_scenes import Run, X, Z
from planning.rigs import CAMERA, NOISE, PLATE

from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.plan import plan_more
from handeye_cli.planning.options import Limits, PlanOptions
from handeye_cli.records import (
    Finding,
    Noise,
    Observation,
    Station,
    Stations,
    TargetSpec,
    UncertainPose,
)
from handeye_cli.solve import solve
from handeye_cli.wording import CALIBRATE_AGAIN

SIGMA = 2e-3
"""Standard deviation of the time that recorded poses are off by, seconds."""
MOTION_NOISE = 0.05
"""Of the poses in motion, as a part of the usual."""


def recorded(setup=Setup.EYE_IN_HAND, count=5, seed=10, **more):
    rng = np.random.default_rng(seed)
    return scenes.stations(rng, scenes.scene(rng, count), NOISE, setup=setup, **more)


def with_pixels(count=4, sigma=0.05):
    """Stations whose target poses come from pixels of a known plate."""
    rng = np.random.default_rng(11)
    perfect = scenes.scene(rng, count)
    spec = {"rows": 6, "columns": 6, "spacing_mm": 5.0, "diameter_mm": 4.0}
    robot = se3.perturb(perfect.A, rng.normal(size=(count, 6)) * ([4e-5] * 3 + [2e-4] * 3))
    seen = []
    for pose in perfect.B:
        pixels = project(se3.transform_points(pose, PLATE), CAMERA.parameters)
        pixels = pixels + sigma * rng.normal(size=pixels.shape)
        seen.append(Observation(np.arange(36), pixels, sigma))
    rows = tuple(
        Station(f"{i:02d}", robot[i], seen[i], UncertainPose(perfect.B[i], 1e-8 * np.eye(6)))
        for i in range(count)
    )
    return Stations(Setup.EYE_IN_HAND, rows, TargetSpec("disc-grid", spec), CAMERA)


@pytest.mark.parametrize("setup", list(Setup))
def test_what_is_there_is_predicted_as_solve_does(setup):
    stations = recorded(setup, given=True)
    error = solve(stations).predicted_error
    first = plan_more(stations, 1).gains[0]
    assert first.rotation_before == pytest.approx(error.rotation, rel=1e-4)
    assert first.translation_before == pytest.approx(error.translation, rel=1e-4)


@pytest.mark.parametrize("setup", list(Setup))
def test_recording_them_gives_what_was_promised(setup):
    stations = recorded(setup, given=True)
    planned = plan_more(stations, 2)
    covariance = scenes.joint_covariance(1, NOISE)[0, 6:, 6:]
    made = []
    for each in planned.stations:
        seen = UncertainPose(np.linalg.inv(each.target_T_camera), covariance)
        made.append(Station(each.name, each.base_T_gripper, None, seen))
    both = Stations(setup, (*stations.stations, *made), noise=NOISE)
    error = solve(both).predicted_error
    promised = planned.predicted_error
    # solving them anew moves the answer by its own noise, and the prediction hardly with it
    assert error.rotation == pytest.approx(promised.rotation, rel=0.02)
    assert error.translation == pytest.approx(promised.translation, rel=0.02)


def test_gains_follow_each_other_and_end_at_the_prediction():
    planned = plan_more(recorded(), 3)
    gains = planned.gains
    assert [gain.name for gain in gains] == [station.name for station in planned.stations]
    for before, after in pairwise(gains):
        assert (before.rotation, before.translation) == (
            after.rotation_before,
            after.translation_before,
        )
    for gain in gains:
        assert gain.rotation < gain.rotation_before
        assert gain.translation < gain.translation_before
    assert gains[-1].rotation == pytest.approx(planned.predicted_error.rotation)
    assert planned.basis.mount == "recording"
    assert planned.pairs == ()


def test_they_beat_more_stations_of_the_same_circle():
    stations = recorded(count=6, given=True)
    half = Stations(stations.setup, stations.stations[::2], noise=stations.noise)
    chosen = plan_more(half, 3).predicted_error
    circle = solve(stations).predicted_error
    assert chosen.rotation < 0.8 * circle.rotation
    assert chosen.translation < 0.8 * circle.translation


def test_they_stay_in_view_and_apart_with_the_plate_known():
    stations = with_pixels()
    planned = plan_more(stations, 2)
    assert planned.basis.camera == "pixels"
    cameras = np.array([each.target_T_camera for each in planned.stations])
    pixels = project(se3.transform_points(se3.inverse(cameras), PLATE), CAMERA.parameters)
    assert np.all((pixels > 0.0) & (pixels < [639.0, 479.0]))
    robot = [each.base_T_gripper for each in (*stations.stations, *planned.stations)]
    turns = np.array([[rotations.angle(a[:3, :3].T @ b[:3, :3]) for a in robot] for b in robot])
    new = turns[4:] + 10.0 * np.eye(6)[4:]
    assert np.degrees(new.min()) >= 10.0 - 1e-9


def test_a_target_seen_from_its_other_side_stays_on_that_side():
    rng = np.random.default_rng(12)
    perfect = scenes.scene(rng, 5)
    flip = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    turned = scenes.Scene(perfect.A, perfect.B @ flip, perfect.X, perfect.Z @ flip)
    stations = scenes.stations(rng, turned, NOISE, given=True)
    planned = plan_more(stations, 2)
    for each in planned.stations:
        assert each.target_T_camera[2, 3] > 0.0
        assert each.target_T_camera[2, 2] < 0.0


def test_limits_hold_for_new_stations():
    limits = Limits(max_tilt=np.radians(15.0), max_roll=np.radians(20.0), depth=(0.15, 0.2))
    planned = plan_more(recorded(), 2, options=PlanOptions(limits=limits))
    cameras = np.array([each.target_T_camera for each in planned.stations])
    away = np.linalg.norm(cameras[:, :3, 3], axis=1)
    assert np.all((away >= 0.15) & (away <= 0.2))
    assert np.all(-cameras[:, 2, 3] >= away * np.cos(np.radians(15.0) + 1e-6))


def test_stated_levels_win():
    quiet = Noise(1e-5, 1e-6)
    planned = plan_more(recorded(), 1, options=PlanOptions(given=quiet))
    assert planned.noise.robot_rotation == 1e-5
    assert planned.gains[0].rotation < plan_more(recorded(), 1).gains[0].rotation


@pytest.mark.parametrize("from_document", [True, False])
def test_a_stated_level_of_the_camera_wins_over_its_covariances(from_document):
    """As solving the same poses with covariances of that level would have it."""
    level = 10.0 * NOISE.camera_translation
    stated = Noise(camera_translation=level)
    stations = recorded(given=True)
    robot = Noise(NOISE.robot_rotation, NOISE.robot_translation)
    quiet = replace(stations, noise=robot)
    if from_document:
        planned = plan_more(replace(quiet, noise=replace(robot, camera_translation=level)), 1)
    else:
        planned = plan_more(quiet, 1, options=PlanOptions(given=stated))
    loud = np.diag(np.repeat([level**2 / 3.0, NOISE.camera_rotation**2 / 3.0], 3))
    rows = (
        replace(each, camera_T_target=replace(each.camera_T_target, covariance=loud))
        for each in stations.stations
    )
    expected = plan_more(replace(quiet, stations=tuple(rows)), 1)
    for name in ("rotation_before", "translation_before", "rotation", "translation"):
        found = getattr(planned.gains[0], name)
        assert found == pytest.approx(getattr(expected.gains[0], name), rel=0.02)
    assert planned.gains[0].translation_before > 2.0 * plan_more(quiet, 1).gains[0].translation


@pytest.mark.parametrize(
    ("given", "robot", "camera"),
    [
        (Noise(), "recording", "recording"),
        (Noise(robot_rotation=1e-4), "recording", "recording"),
        (Noise(1e-4, 1e-5), "given", "recording"),
        (Noise(camera_rotation=1e-4, camera_translation=1e-5), "recording", "given"),
    ],
)
def test_the_basis_says_which_levels_were_stated(given, robot, camera):
    basis = plan_more(recorded(), 1, options=PlanOptions(given=given)).basis
    assert (basis.robot, basis.camera, basis.mount) == (robot, camera, "recording")


def in_motion(setup, views=10):
    """A recording of a robot that never paused, whose times are off by one error."""
    run = Run(np.random.default_rng(3), setup=setup, views=views, noise=MOTION_NOISE)
    return run, run.moving_views()


def at_times(run, seen, error):
    """Its stations with all poses at times that are off by so many standard deviations."""
    times = seen.times + run.offset
    poses = run.path(1000.0).at(times + SIGMA * error)
    shared = SIGMA * seen.path.velocities(times)
    rows = zip(poses, seen.B, seen.covariance, shared, strict=True)
    return Stations(
        run.setup,
        tuple(
            Station(f"{i:02d}", A, camera_T_target=UncertainPose(B, C), shared_error=moved)
            for i, (A, B, C, moved) in enumerate(rows)
        ),
        noise=Noise(*(MOTION_NOISE * np.array([3.5e-4, 9e-5]))),
    )


@pytest.mark.parametrize("setup", list(Setup))
def test_what_is_there_is_predicted_as_solve_does_with_a_dominating_shared_error(setup):
    stations = at_times(*in_motion(setup), 0.0)
    error = solve(stations).predicted_error
    quiet = replace(
        stations, stations=tuple(replace(each, shared_error=None) for each in stations.stations)
    )
    assert error.rotation > 3.0 * solve(quiet).predicted_error.rotation
    first = plan_more(stations, 1).gains[0]
    assert first.rotation_before == pytest.approx(error.rotation, rel=1e-3)
    assert first.translation_before == pytest.approx(error.translation, rel=1e-3)


@pytest.mark.parametrize("setup", list(Setup))
def test_gains_hold_where_recorded_poses_share_an_error(setup):
    """The new stations are recorded standing still, and all are solved for many times' errors."""
    run, seen = in_motion(setup)
    planned = plan_more(at_times(run, seen, 0.0), 3)
    robot = np.array([each.base_T_gripper for each in planned.stations])
    A = robot if setup is Setup.EYE_IN_HAND else se3.inverse(robot)
    new = tuple(
        Station(each.name, pose, None, UncertainPose(B, C))
        for each, pose, B, C in zip(
            planned.stations, robot, se3.inverse(A @ X) @ Z, seen.covariance, strict=False
        )
    )
    away = {"before": [], "after": []}
    for chance in (np.arange(20) + 0.5) / 20:
        old = at_times(run, seen, NormalDist().inv_cdf(chance))
        both = replace(old, stations=(*old.stations, *new))
        for name, stations in (("before", old), ("after", both)):
            away[name].append(se3.difference(scenes.estimated(stations).solution.X, X))
    gains = planned.gains
    promised = {
        "before": (gains[0].rotation_before, gains[0].translation_before),
        "after": (gains[-1].rotation, gains[-1].translation),
    }
    for name, each in away.items():
        squares = np.sum(np.reshape(each, (-1, 2, 3)) ** 2, axis=-1).mean(axis=0)[::-1]
        np.testing.assert_allclose(np.sqrt(squares) / promised[name], 1.0, atol=0.12)
    assert gains[-1].rotation < 0.8 * gains[0].rotation_before


def test_names_go_on_where_the_recording_ends():
    stations = recorded(count=3)
    rows = [Station(name, each.base_T_gripper, None, each.camera_T_target)
            for name, each in zip(("a", "03", "b"), stations.stations, strict=True)]  # fmt: skip
    planned = plan_more(Stations(stations.setup, tuple(rows)), 2)
    assert [each.name for each in planned.stations] == ["04", "05"]


def test_none_and_too_many_are_refused():
    with pytest.raises(UsageError, match="1 to 50 stations to add, found 0"):
        plan_more(recorded(), 0)
    with pytest.raises(UsageError, match="found 51"):
        plan_more(recorded(), 51)


def test_a_recording_that_determines_nothing_is_refused():
    stations = recorded(count=3)
    with pytest.raises(UndeterminedError, match="at least 3 stations"):
        plan_more(Stations(stations.setup, stations.stations[:2]), 2)


def understated():
    """A recording whose noise is three times what its document says."""
    stations = recorded(count=8)
    levels = (None if level is None else level / 3.0 for level in vars(NOISE).values())
    quiet = replace(stations, noise=Noise(*levels))
    rows = (
        replace(each, camera_T_target=replace(each.camera_T_target, covariance=None))
        for each in stations.stations
    )
    return replace(quiet, stations=tuple(rows))


def test_what_solve_adds_for_no_noise_is_kept_and_told():
    stations = understated()
    answer = solve(stations)
    assert "noise-understated" in [each.code for each in answer.diagnosis]
    planned = plan_more(stations, 3)
    first, last = planned.gains[0], planned.gains[-1]
    error = answer.predicted_error
    assert first.rotation_before == pytest.approx(error.rotation, rel=1e-6)
    assert first.translation_before == pytest.approx(error.translation, rel=1e-6)
    used = tuple(
        station for station, row in zip(stations.stations, answer.stations, strict=True) if row.used
    )
    of_noise = scenes.calibrated(replace(stations, stations=used)).predicted_error.rotation
    lasting = np.sqrt(error.rotation**2 - of_noise**2)
    assert lasting < last.rotation < error.rotation
    told = planned.diagnosis[-1]
    assert (told.code, told.severity) == ("new-stations-not-enough", "warning")
    assert f"{1e3 * lasting:.3g} mrad" in told.message
    assert "(noise-understated)" in told.message
    assert {each.code for each in answer.diagnosis} < {each.code for each in planned.diagnosis}


def test_nothing_is_told_to_stay_where_all_is_noise():
    codes = [each.code for each in plan_more(recorded(given=True), 1).diagnosis]
    assert "new-stations-not-enough" not in codes


def test_a_plan_advises_whole_commands():
    doubt = Finding("intrinsics-doubtful", "warning", "2 px", CALIBRATE_AGAIN)
    stations = replace(recorded(given=True), findings=(doubt,))
    (told,) = [each for each in plan_more(stations, 1).diagnosis if each.code == doubt.code]
    assert told.message == "2 px"
    assert "handeye extrinsics RECORDING --calibrate-intrinsics -o calibrated.yaml" in told.advice
    assert "handeye plan --after calibrated.yaml --stations 1'" in told.advice


def test_a_plan_does_not_send_to_another_plan():
    note = Finding("lengths-not-checked", "info", "", "a second 'handeye plan' would check it")
    stations = replace(recorded(given=True), findings=(note,))
    told = next(each for each in plan_more(stations, 1).diagnosis if each.code == note.code)
    assert told.advice.startswith("let new stations stand at other distances, with --depth")
