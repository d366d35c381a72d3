"""The paper's station generator: distances, aim, angles between stations and between axes."""

import math

import numpy as np
import pytest

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.star import all_pairs, star_pairs
from handeye_cli.geometry.station_generator import (
    angles_between_axes,
    between_angles,
    circle_angles,
    generate_stations,
    interstation_angles,
    robot_poses,
    tilted_stations,
)

TILT = math.radians(30.0)


def star_angles_deg(count: int) -> np.ndarray:
    poses = generate_stations(count, 0.17, TILT)
    return np.degrees(interstation_angles(poses, star_pairs(count)))


def test_three_stations_have_the_papers_interstation_angle():
    assert star_angles_deg(3) == pytest.approx([51.8] * 3, abs=0.05)


@pytest.mark.parametrize(("count", "least"), [(7, 58.0), (10, 45.0), (12, 45.0)])
def test_star_pairs_turn_far(count, least):
    assert star_angles_deg(count).min() >= least


def test_three_stations_have_axes_near_sixty_degrees():
    poses = generate_stations(3, 0.17, math.radians(1.0))
    angles = angles_between_axes(poses, star_pairs(3))
    assert np.degrees(angles[~np.eye(3, dtype=bool)]) == pytest.approx([60.0] * 6, abs=0.01)
    assert np.diag(angles) == pytest.approx(np.zeros(3), abs=1e-7)


def test_angles_against_a_loop_over_pairs_with_scalar_formulas():
    poses = generate_stations(6, 0.2, TILT)
    pairs = all_pairs(6)
    axes = []
    for k, (i, j) in enumerate(pairs):
        motion = np.linalg.inv(poses[j]) @ poses[i]
        angle = math.acos((np.trace(motion[:3, :3]) - 1.0) / 2.0)
        assert interstation_angles(poses, pairs)[k] == pytest.approx(angle, abs=1e-12)
        axes.append(rotations.log(motion[:3, :3]) / angle)
    cosine = np.abs(np.array(axes) @ np.array(axes).T)
    assert np.cos(angles_between_axes(poses, pairs)) == pytest.approx(cosine, abs=1e-12)


def test_gripper_axes_enclose_the_same_angles_as_camera_axes():
    rng = np.random.default_rng(4)
    camera = generate_stations(5, 0.2, TILT)
    X = se3.perturb(np.eye(4), rng.normal(size=6))
    Z = se3.perturb(np.eye(4), rng.normal(size=6))
    gripper = robot_poses(camera, X, Z, Setup.EYE_IN_HAND)
    pairs = star_pairs(5)
    assert angles_between_axes(gripper, pairs) == pytest.approx(angles_between_axes(camera, pairs))


@pytest.mark.parametrize("count", [3, 4, 7, 12])
def test_every_camera_looks_at_the_aim_point_at_the_distance(count):
    centre = np.array([0.03, -0.02, 0.001])
    target_T_camera = generate_stations(count, 0.17, TILT, centre)
    seen = se3.transform_points(se3.inverse(target_T_camera), centre[None, :])[:, 0]
    assert seen == pytest.approx(np.tile([0.0, 0.0, 0.17], (count, 1)), abs=1e-15)


@pytest.mark.parametrize("count", [3, 8])
def test_cameras_stay_in_front_of_the_plate_at_the_tilt(count):
    poses = generate_stations(count, 0.17, TILT)
    assert poses[:, 2, 3] == pytest.approx([-0.17 * math.cos(TILT)] * count)
    assert poses[:, 2, 2] == pytest.approx([math.cos(TILT)] * count)


def test_each_station_is_c0_turned_about_its_own_axis():
    c0 = np.eye(4)
    c0[2, 3] = -0.25
    for i, pose in enumerate(generate_stations(5, 0.25, TILT)):
        axis = [math.cos(2 * math.pi * i / 5), math.sin(2 * math.pi * i / 5), 0.0]
        turn = se3.from_parts(rotations.exp(TILT * np.array(axis)), np.zeros(3))
        assert pose == pytest.approx(turn @ c0, abs=1e-15)


@pytest.mark.parametrize("batch", [(), (4,), (2, 3)])
def test_batch_equals_loop(batch):
    rng = np.random.default_rng(7)
    distance, tilt = rng.uniform(0.1, 0.4, batch), rng.uniform(0.1, 1.0, batch)
    centre = rng.normal(size=(*batch, 3))
    poses = generate_stations(7, distance, tilt, centre)
    pairs = star_pairs(7)
    assert poses.shape == (*batch, 7, 4, 4)
    assert interstation_angles(poses, pairs).shape == (*batch, 7)
    assert angles_between_axes(poses, pairs).shape == (*batch, 7, 7)
    for index in np.ndindex(*batch):
        one = generate_stations(7, float(distance[index]), float(tilt[index]), centre[index])
        assert poses[index] == pytest.approx(one, abs=1e-15)
        assert interstation_angles(poses, pairs)[index] == pytest.approx(
            interstation_angles(one, pairs)
        )


def test_tilt_alone_may_be_batched():
    assert generate_stations(3, 0.2, np.array([0.2, 0.3])).shape == (2, 3, 4, 4)


@pytest.mark.parametrize(("count", "wanted"), [(6, 6), (6, 4), (7, 3), (5, 1), (3, 0)])
def test_between_angles_lie_half_way_and_are_distinct(count, wanted):
    angles = between_angles(count, wanted)
    step = 2 * math.pi / count
    assert len(set(np.round(angles, 9))) == wanted
    assert np.all((angles >= 0) & (angles < 2 * math.pi))
    distance = np.abs((angles[:, None] - circle_angles(count) + math.pi) % (2 * math.pi) - math.pi)
    if wanted:
        assert distance.min(axis=1) == pytest.approx([step / 2] * wanted)


@pytest.mark.parametrize("wanted", [-1, 7])
def test_more_directions_than_gaps_are_refused(wanted):
    with pytest.raises(ValueError, match=f"0 to 6 directions between 6, found {wanted}"):
        between_angles(6, wanted)


@pytest.mark.parametrize("setup", list(Setup))
def test_robot_poses_close_the_loop(setup):
    rng = np.random.default_rng(11)
    mount_T_camera = se3.perturb(np.eye(4), rng.normal(size=6))
    reference_T_target = se3.perturb(np.eye(4), rng.normal(size=6))
    target_T_camera = tilted_stations(rng.uniform(0, 6, 4), 0.2, 0.5)
    base_T_gripper = robot_poses(target_T_camera, mount_T_camera, reference_T_target, setup)
    camera_T_target = np.linalg.inv(target_T_camera)
    if setup is Setup.EYE_IN_HAND:
        closed = base_T_gripper @ mount_T_camera @ camera_T_target
        expected = np.broadcast_to(reference_T_target, closed.shape)
    else:
        closed = base_T_gripper @ reference_T_target
        expected = mount_T_camera @ camera_T_target
    assert closed == pytest.approx(expected, abs=1e-14)
