"""Simulated recordings: the truth closes the loop, the pictures show it, the layout is declared."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from simulate.small_rig import CENTRE, PLATE, RIG, taken

from handeye_cli import targets
from handeye_cli.conventions import Setup, parse_length
from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Noise, TargetSpec
from handeye_cli.simulate.recording import simulate_recording
from handeye_cli.simulate.render import Appearance


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


def test_stations_and_pictures_may_have_names():
    cameras = generate_stations(3, 0.2, 0.4, CENTRE)
    recording = simulate_recording(RIG, cameras, 1, names=["a", "b", "c"]).recording
    assert [station.name for station in recording.stations] == ["a", "b", "c"]
    assert recording.stations[1].image.label == "images/b.png"
    unnamed = simulate_recording(RIG, cameras, 1).recording
    assert np.array_equal(recording.stations[1].image.load(), unnamed.stations[1].image.load())


def pictures(simulated):
    return [station.image.load() for station in simulated.recording.stations]


def test_a_moved_plate_is_seen_where_it_is_and_the_robot_does_not_know():
    before, after = taken(), taken(faults=["moved-plate:2:3mm"])
    told = [[station.base_T_gripper for station in r.recording.stations] for r in (before, after)]
    assert np.array_equal(*told)
    assert np.array_equal(before.camera_T_target[:2], after.camera_T_target[:2])
    way = se3.inverse(before.camera_T_target[2:]) @ after.camera_T_target[2:]
    moved = se3.from_parts(np.eye(3), np.array([3e-3, 0.0, 0.0]))
    assert way == pytest.approx(np.broadcast_to(moved, way.shape), abs=1e-15)
    same = list(map(np.array_equal, pictures(before), pictures(after)))
    assert same == [True, True, False, False]


def test_swapped_pictures_lie_under_each_other_and_are_noisy_in_their_own_way():
    rig = replace(RIG, appearance=Appearance())
    plain, swapped = taken(rig), taken(rig, faults=["swapped:1,3"])
    assert np.array_equal(plain.camera_T_target, swapped.camera_T_target)
    before, after = pictures(plain), pictures(swapped)
    for index, shown in enumerate([0, 3, 2, 1]):
        assert np.array_equal(after[index], before[shown])


def test_a_larger_print_is_seen_larger_and_declared_as_before():
    simulated = taken(replace(RIG, appearance=Appearance()), faults=["scaled:1.25"])
    assert simulated.recording.target is PLATE
    centres = 1.25 * targets.build(PLATE).points()
    for picture, pose in zip(pictures(simulated), simulated.camera_T_target, strict=True):
        pixels = project(se3.transform_points(pose, centres), RIG.camera.parameters)
        u, v = np.rint(pixels).astype(int).T
        inside = (u >= 0) & (u < 90) & (v >= 0) & (v < 80)
        assert inside.sum() >= 5
        assert np.all(picture[v[inside], u[inside]] == 35)


def test_a_robot_of_another_scale_tells_longer_ways():
    rig = replace(RIG, noise=Noise())
    simulated = taken(rig, faults=["robot-scale:1.003"])
    told = np.stack([station.base_T_gripper for station in simulated.recording.stations])
    truth = simulated.base_T_gripper
    assert told[:, :3, 3] == pytest.approx(1.003 * truth[:, :3, 3], rel=1e-14)
    assert told[:, :3, :3] == pytest.approx(truth[:, :3, :3], abs=1e-14)


def centroid_of_bowed_disc(camera, pose, disc, depth):
    """The middle and the area of a bent disc's image, from a dense grid of its own points."""
    x, y, radius = disc
    k = (np.arange(150) + 0.5) / 150
    r, angle = np.meshgrid(radius * np.sqrt(k), 2 * np.pi * k)
    a, b = x + r * np.cos(angle), y + r * np.sin(angle)

    def seen(da, db):
        points = np.stack([a + da, b + db, depth(a + da, b + db)], axis=-1)
        return project(se3.transform_points(pose, points.reshape(-1, 3)), camera.parameters)

    h = 1e-7
    across, along = (
        (seen(h * i, h * j) - seen(-h * i, -h * j)) / (2 * h) for i, j in ((1, 0), (0, 1))
    )
    area = np.abs(across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])
    total = math.pi * radius**2 * area.mean()
    return np.average(seen(0, 0), axis=0, weights=area), total


@pytest.mark.parametrize("bow", ["0.3mm", "1.5mm", "-1.5mm"])
def test_a_bowed_plate_is_drawn_where_its_points_in_space_are_seen(bow):
    """5 % and 27 % of the plate's radius, towards the camera and away; the mean depth stays."""
    appearance = Appearance(background=205.0, ink=5.0, blur_px=0.5)
    camera = Camera(320, 280, 2000.0, 2000.0, 159.5, 139.5, (-0.1, 0.05, 0.0, 0.0, 0.0))
    rig = replace(RIG, appearance=appearance, camera=camera)
    simulated = taken(rig, count=3, faults=[f"bowed:{bow}"])
    centres = targets.build(PLATE).points()
    square = np.sum((centres[:, :2] - CENTRE[:2]) ** 2, axis=1)
    slope = parse_length(bow) / square.max()

    def depth(x, y):
        away = (x - CENTRE[0]) ** 2 + (y - CENTRE[1]) ** 2
        return slope * (away - square.mean())

    v, u = np.indices((280, 320))
    for station, pose in zip(simulated.recording.stations, simulated.camera_T_target, strict=True):
        dark = (205.0 - station.image.light()) / 200.0
        flat = project(se3.transform_points(pose, centres), camera.parameters)
        discs = [centroid_of_bowed_disc(camera, pose, (x, y, 2e-3), depth) for x, y, _ in centres]
        nearest = np.argmin([(u - m[0]) ** 2 + (v - m[1]) ** 2 for m, _ in discs], axis=0)
        for disc, (expected, area) in enumerate(discs):
            share = dark * (nearest == disc)
            middle = [np.sum(share * u), np.sum(share * v)] / share.sum()
            assert middle == pytest.approx(expected, abs=3e-4)
            assert share.sum() == pytest.approx(area, rel=1e-4)
        bent = simulated.scene.pixels(pose)
        assert np.abs(bent - flat).max() > 0.5


def test_a_plate_that_is_hardly_bowed_looks_like_a_flat_one():
    rig = replace(RIG, appearance=Appearance())
    flat, bent = taken(rig), taken(rig, faults=["bowed:0.0001mm"])
    for one, other in zip(flat.recording.stations, bent.recording.stations, strict=True):
        assert other.image.light() == pytest.approx(one.image.light(), abs=0.05)


def test_missing_pictures_are_still_there_to_be_left_out():
    simulated = taken(faults=["dropped:1"])
    assert simulated.staging.missing.tolist() == [False, True, False, False]
    assert len(simulated.recording.stations) == 4


def test_a_fault_at_a_station_that_is_not_there_is_refused():
    with pytest.raises(UsageError, match="00, 01, 02, 03, found '4'"):
        taken(faults=["dropped:4"])


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
