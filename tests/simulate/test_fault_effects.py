"""What faults do to what is measured: each in its own way, and by as much as it says.

Six stations in small pictures go through the line up to the target's poses. With the true answer
each station then says where the target is on the table; there the faults show one by one.
"""

import numpy as np
import pytest

from handeye_cli import pipeline, targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Noise
from handeye_cli.simulate import default_rig
from handeye_cli.simulate.faults import parse
from handeye_cli.simulate.recording import Rig, simulate_recording
from handeye_cli.simulate.render import Appearance

CAMERA = Camera(320, 240, 275.0, 275.0, 159.5, 119.5)
SPEC = targets.parse("chessboard:6x5:5mm")
POINTS = targets.build(SPEC).points()
DISTANCE = default_rig.filling_distance(POINTS, CAMERA)
RIG = Rig(
    target=SPEC,
    camera=CAMERA,
    mount_T_camera=default_rig.mount_T_camera(Setup.EYE_IN_HAND),
    reference_T_target=default_rig.reference_T_target(Setup.EYE_IN_HAND),
    noise=Noise(robot_rotation=2e-4, robot_translation=5e-5),
    appearance=Appearance(noise=1.0),
)
NEAR = 0.5e-3
"""Metres and radians: five times the scatter of these stations' poses of the target."""


def measured(*faults):
    """The recording, and the (6, 6) errors of where each station has the target on the table."""
    cameras = generate_stations(6, DISTANCE, np.radians(30), POINTS.mean(axis=0))
    simulated = simulate_recording(RIG, cameras, 5, faults=[parse(text) for text in faults])
    stations = pipeline.to_stations(simulated.recording, pipeline.Steps(workers=1))
    told = np.stack([station.base_T_gripper for station in stations.stations])
    seen = np.stack([station.camera_T_target.matrix for station in stations.stations])
    places = told @ RIG.mount_T_camera @ seen
    return simulated, stations, se3.difference(places, RIG.reference_T_target)


def test_without_a_fault_all_stations_have_the_target_in_its_place():
    _, stations, errors = measured()
    assert np.abs(errors[:, :3]).max() < NEAR
    assert np.abs(errors[:, 3:]).max() < 10 * NEAR
    answer = pipeline.to_calibration(
        stations, pipeline.Steps(), method="maximum-likelihood", pairs="star"
    )
    apart = se3.difference(answer.mount_T_camera.matrix, RIG.mount_T_camera)
    assert np.linalg.norm(apart[3:]) < answer.predicted_error.rotation_95
    assert np.linalg.norm(apart[:3]) < answer.predicted_error.translation_95


def test_a_moved_plate_is_elsewhere_from_its_station_on():
    _, _, errors = measured("moved-plate:3:2mm")
    along_x = 2e-3 * RIG.reference_T_target[:3, 0]
    assert np.abs(errors[:3, :3]).max() < NEAR
    assert np.abs(errors[3:, :3] - along_x).max() < NEAR


def test_swapped_pictures_put_the_target_where_it_is_not_at_two_stations():
    simulated, stations, errors = measured("swapped:1,4")
    off = np.linalg.norm(errors[:, 3:], axis=1) > 0.2
    assert off.tolist() == [False, True, False, False, True, False]
    seen = np.stack([station.camera_T_target.matrix for station in stations.stations])
    shown = simulated.camera_T_target[[0, 4, 2, 3, 1, 5]]
    assert np.abs(se3.difference(seen, shown)[:, :3]).max() < NEAR


def test_a_larger_print_is_taken_for_a_nearer_one():
    simulated, stations, _ = measured("scaled:1.05")
    seen = np.stack([station.camera_T_target.matrix for station in stations.stations])
    ratio = seen[:, 2, 3] / simulated.camera_T_target[:, 2, 3]
    assert ratio == pytest.approx(1 / 1.05, rel=NEAR / DISTANCE)


def test_a_robot_of_another_scale_puts_the_target_farther_away():
    simulated, _, errors = measured("robot-scale:1.02")
    expected = 0.02 * simulated.base_T_gripper[:, :3, 3]
    assert np.abs(errors[:, :3] - expected).max() < NEAR


def test_a_bowed_plate_is_found_where_it_is_bent_to_and_fits_no_plane():
    simulated, stations, _ = measured("bowed:0.6mm")
    for station, truth in zip(stations.stations, simulated.camera_T_target, strict=True):
        seen = station.observation
        of_plane = se3.transform_points(station.camera_T_target.matrix, POINTS[seen.ids])
        plane = of_plane[:, :2] / of_plane[:, 2:] * 275.0 + [159.5, 119.5]
        assert np.sqrt(np.mean((seen.pixels - simulated.scene.pixels(truth)[seen.ids]) ** 2)) < 0.1
        assert np.sqrt(np.mean((seen.pixels - plane) ** 2)) > 0.2
