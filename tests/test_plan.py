"""Planning: stations to visit, their names and purposes, robot poses, and what is refused."""

import math

import numpy as np
import pytest

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.star import star_pairs
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.plan import plan
from handeye_cli.planning.options import Limits, PlanOptions
from handeye_cli.records.planning import PlanBasis

GUESSES = {"mount_T_camera": np.eye(4), "reference_T_target": np.eye(4)}


def test_default_plan_is_the_papers_generator():
    planned = plan(7)
    poses = np.stack([station.target_T_camera for station in planned.stations])
    assert poses == pytest.approx(generate_stations(7, 0.17, math.radians(30.0)))
    assert planned.pairs == tuple(map(tuple, star_pairs(7).tolist()))
    assert planned.setup is Setup.EYE_IN_HAND
    assert all(station.base_T_gripper is None for station in planned.stations)


def test_names_and_purposes_are_in_order():
    planned = plan(6, verification=4)
    assert [station.name for station in planned.stations] == [f"{i:02d}" for i in range(10)]
    purposes = [station.purpose for station in planned.stations]
    assert purposes == ["calibrate"] * 6 + ["verify"] * 4
    assert max(max(pair) for pair in planned.pairs) == 5


def test_many_stations_keep_names_of_one_width():
    names = [station.name for station in plan(101).stations]
    assert (names[0], names[-1]) == ("000", "100")


def test_verification_stations_lie_half_way_at_the_same_distance():
    planned = plan(6, distance=0.2, tilt=0.4, verification=6)
    poses = np.stack([station.target_T_camera for station in planned.stations])
    doubled = generate_stations(12, 0.2, 0.4)
    assert poses[:6] == pytest.approx(doubled[0::2])
    assert poses[6:] == pytest.approx(doubled[1::2])


def test_aim_point_is_the_centre():
    centre = np.array([0.0125, 0.0125, 0.0])
    for station in plan(5, distance=0.17, centre=centre).stations:
        seen = np.linalg.inv(station.target_T_camera) @ [*centre, 1.0]
        assert seen == pytest.approx([0.0, 0.0, 0.17, 1.0], abs=1e-15)


@pytest.mark.parametrize("setup", list(Setup))
def test_robot_poses_bring_the_camera_where_it_is_wanted(setup):
    rng = np.random.default_rng(3)
    mount_T_camera = se3.perturb(np.eye(4), rng.normal(size=6))
    reference_T_target = se3.perturb(np.eye(4), rng.normal(size=6))
    planned = plan(
        4,
        setup=setup,
        mount_T_camera=mount_T_camera,
        reference_T_target=reference_T_target,
        verification=2,
    )
    for station in planned.stations:
        assert station.base_T_gripper is not None
        reference_T_mount = (
            station.base_T_gripper
            if setup is Setup.EYE_IN_HAND
            else np.linalg.inv(station.base_T_gripper)
        )
        target_T_camera = np.linalg.inv(reference_T_target) @ reference_T_mount @ mount_T_camera
        assert target_T_camera == pytest.approx(station.target_T_camera, abs=1e-13)


@pytest.mark.parametrize(
    ("arguments", "value"),
    [
        ({"count": 2}, "found 2"),
        ({"count": -1}, "found -1"),
        ({"count": 3, "distance": 0.0}, "found 0 mm"),
        ({"count": 3, "distance": -0.17}, "found -170 mm"),
        ({"count": 3, "distance": math.nan}, "found nan mm"),
        ({"count": 3, "distance": math.inf}, "found inf mm"),
        ({"count": 3, "tilt": 0.0}, "found 0 deg"),
        ({"count": 3, "tilt": math.radians(81.0)}, "found 81 deg"),
        ({"count": 3, "tilt": math.nan}, "found nan deg"),
        ({"count": 3, "verification": 4}, "0 to 3 verification stations, found 4"),
        ({"count": 3, "verification": -1}, "found -1"),
    ],
)
def test_numbers_out_of_range_are_refused_with_the_value(arguments, value):
    with pytest.raises(UsageError, match=value):
        plan(**arguments)


def test_a_tilt_of_eighty_degrees_is_accepted():
    assert len(plan(3, tilt=math.radians(80.0)).stations) == 3


@pytest.mark.parametrize(
    ("setup", "given", "found"),
    [
        (Setup.EYE_IN_HAND, "mount_T_camera", "found only gripper_T_camera"),
        (Setup.EYE_IN_HAND, "reference_T_target", "found only base_T_target"),
        (Setup.EYE_TO_HAND, "mount_T_camera", "found only base_T_camera"),
        (Setup.EYE_TO_HAND, "reference_T_target", "found only gripper_T_target"),
    ],
)
def test_one_guess_alone_is_refused(setup, given, found):
    with pytest.raises(UsageError, match=found):
        plan(3, setup=setup, **{given: np.eye(4)})


def test_a_plan_is_predicted_and_says_on_what_ground():
    planned = plan(5)
    assert planned.predicted_error is not None
    assert planned.predicted_error.rotation < planned.predicted_error.rotation_95
    assert (planned.circle, planned.moved, planned.order) == (None, (), ())
    assert planned.basis == PlanBasis("paper", "paper", "lever", 9.5 * 0.0254)


def test_more_stations_and_a_shorter_lever_are_better():
    errors = [plan(count).predicted_error for count in (4, 8, 16)]
    assert errors[0].rotation / errors[2].rotation == pytest.approx(2.0, rel=0.15)
    assert errors[0].translation > errors[1].translation > errors[2].translation
    near = plan(8, options=PlanOptions(lever=0.05)).predicted_error
    assert near.translation < errors[1].translation


def test_stations_to_verify_on_keep_the_limits_too():
    limits = Limits(max_tilt=math.radians(20.0))
    planned = plan(3, verification=3, options=PlanOptions(limits=limits))
    poses = np.stack([station.target_T_camera for station in planned.stations])
    normal = -poses[:, 2, 3] / np.linalg.norm(poses[:, :3, 3], axis=1)
    assert np.all(np.degrees(np.arccos(normal)) <= 20.0 + 1e-6)
    assert [each.name for each in planned.moved] == [f"{i:02d}" for i in range(6)]
    assert planned.circle is not None
    assert not planned.circle.allowed


def test_chosen_stations_come_before_those_to_verify_on():
    planned = plan(3, verification=2, options=PlanOptions(optimize=True), **GUESSES)
    assert [each.purpose for each in planned.stations] == ["calibrate"] * 3 + ["verify"] * 2
    between = generate_stations(6, 0.17, math.radians(30.0))[1::2]
    verify = np.stack([each.target_T_camera for each in planned.stations[3:]])
    assert verify == pytest.approx(between[:2], abs=1e-15)


@pytest.mark.parametrize(
    ("count", "options", "message"),
    [
        (51, PlanOptions(optimize=True), "at most 50 stations .*, found 51"),
        (201, PlanOptions(limits=Limits(max_tilt=1.0)), "at most 200 stations .*, found 201"),
    ],
)
def test_too_many_stations_for_what_is_wanted(count, options, message):
    with pytest.raises(UsageError, match=message):
        plan(count, options=options)
