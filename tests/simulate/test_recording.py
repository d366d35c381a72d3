"""Simulated recordings: the truth closes the loop, the pictures show it, the layout is declared."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Noise, TargetSpec
from handeye_cli.simulate.recording import Rig, simulate_recording
from handeye_cli.simulate.render import Appearance

PLATE = TargetSpec("disc-grid", {"rows": 2, "columns": 3, "spacing_mm": 5, "diameter_mm": 4})
RIG = Rig(
    target=PLATE,
    camera=Camera(90, 80, 500.0, 500.0, 44.5, 39.5),
    mount_T_camera=se3.from_parts(
        rotations.exp(np.array([0.2, -0.3, 1.0])), np.array([0.1, -0.1, 0.15])
    ),
    reference_T_target=se3.from_parts(
        rotations.exp(np.array([3.0, 0.2, 0.1])), np.array([0.5, 0.1, 0.0])
    ),
    noise=Noise(robot_rotation=2e-4, robot_translation=5e-5),
    appearance=Appearance(noise=1.0),
)
CENTRE = np.array([0.005, 0.0025, 0.0])


def taken(rig: Rig = RIG, count: int = 4, seed: int = 1):
    return simulate_recording(rig, generate_stations(count, 0.2, 0.4, CENTRE), seed)


@pytest.mark.parametrize("setup", list(Setup))
def test_the_truth_closes_the_loop(setup):
    simulated = taken(replace(RIG, setup=setup))
    robot = simulated.base_T_gripper
    reference_T_mount = robot if setup is Setup.EYE_IN_HAND else np.linalg.inv(robot)
    closed = reference_T_mount @ simulated.mount_T_camera @ simulated.camera_T_target
    expected = np.broadcast_to(simulated.reference_T_target, closed.shape)
    assert closed == pytest.approx(expected, abs=1e-14)
    assert simulated.recording.setup is setup


def test_robot_poses_carry_their_noise():
    simulated = taken(count=200)
    measured = np.stack([station.base_T_gripper for station in simulated.recording.stations])
    error = se3.difference(measured, simulated.base_T_gripper)
    lowest, highest = chi2.ppf([1e-5, 1 - 1e-5], 600) / 600
    assert lowest < np.mean(np.sum(error[:, :3] ** 2, axis=1)) / 5e-5**2 < highest
    assert lowest < np.mean(np.sum(error[:, 3:] ** 2, axis=1)) / 2e-4**2 < highest


def test_picture_shows_the_discs_where_the_truth_projects_them():
    simulated = taken(replace(RIG, appearance=Appearance()))
    centres = targets.build(PLATE).points()
    for i, station in enumerate(simulated.recording.stations):
        points = se3.transform_points(simulated.camera_T_target[i], centres)
        u, v = np.rint(project(points, RIG.camera.parameters)).astype(int).T
        image = station.image.load()
        assert image.shape == (80, 90)
        assert np.all(image[v, u] == 35)
        assert image[0, 0] == 80


def test_pictures_are_the_same_each_time_and_differ_by_station_and_seed():
    simulated = taken()
    first = simulated.recording.stations[0].image
    assert np.array_equal(first.load(), first.load())
    assert np.array_equal(first.load(), taken().recording.stations[0].image.load())
    assert not np.array_equal(first.load(), taken(seed=2).recording.stations[0].image.load())


def test_a_picture_does_not_depend_on_the_other_stations():
    cameras = generate_stations(5, 0.2, 0.4, CENTRE)
    few, many = (simulate_recording(RIG, cameras[:n], 3).recording for n in (2, 5))
    assert np.array_equal(few.stations[1].image.load(), many.stations[1].image.load())


def test_recording_declares_what_it_was_made_with():
    recording = taken(count=3).recording
    assert [station.name for station in recording.stations] == ["00", "01", "02"]
    assert [station.image.label for station in recording.stations][2] == "images/02.png"
    assert recording.target is PLATE
    assert recording.camera is RIG.camera


def test_corner_disc_is_drawn_larger():
    corner = TargetSpec("disc-grid", {**PLATE.parameters, "corner_diameter_mm": 4.8})
    facing = np.eye(4)[None].copy()
    facing[0, :3, 3] = [0.005, 0.0025, -0.2]

    def darkness(target):
        rig = replace(RIG, target=target, appearance=Appearance(background=205.0))
        image = simulate_recording(rig, facing, 1).recording.stations[0].image.load()
        return np.sum(205.0 - image) / 170.0

    added = math.pi * (2.4**2 - 2.0**2) * 2.5**2
    assert darkness(corner) - darkness(PLATE) == pytest.approx(added, abs=0.1)


def test_a_target_of_any_type_is_seen_and_found():
    spec = targets.parse("charuco:4x3:10mm:7mm:DICT_4X4_50")
    rig = replace(RIG, target=spec, camera=Camera(240, 200, 500.0, 500.0, 119.5, 99.5))
    middle = np.array([0.01, 0.005, 0.0])
    simulated = simulate_recording(rig, generate_stations(3, 0.15, 0.3, middle), 1)
    board = targets.build(spec)
    for station, pose in zip(simulated.recording.stations, simulated.camera_T_target, strict=True):
        seen = board.detect(station.image.load())
        truth = project(se3.transform_points(pose, board.points()), rig.camera.parameters)
        assert list(seen.ids) == list(range(6))
        assert np.abs(seen.pixels - truth).max() < 0.3


@pytest.mark.parametrize(
    ("target", "found"),
    [
        (TargetSpec("disk-grid", {}), "found 'disk-grid'"),
        (TargetSpec("disc-grid", {"rows": 6}), "columns"),
        (TargetSpec("disc-grid", {**PLATE.parameters, "diameter_mm": -4}), "found -4"),
    ],
)
def test_targets_that_cannot_be_drawn_are_refused(target, found):
    with pytest.raises(InputError, match=found):
        taken(replace(RIG, target=target))
