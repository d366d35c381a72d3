"""Stations to add to a recording: what they are worth, and whether they keep that promise."""

from itertools import pairwise

import numpy as np
import pytest
import scenes
from planning.rigs import CAMERA, NOISE, PLATE

from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.plan import plan_more
from handeye_cli.planning.options import Limits, PlanOptions
from handeye_cli.records import Noise, Observation, Station, Stations, TargetSpec, UncertainPose
from handeye_cli.solve import solve


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
