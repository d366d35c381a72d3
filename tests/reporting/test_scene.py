"""Lines in space stand where the products of poses put them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reporting import cases

from handeye_cli.conventions import Setup
from handeye_cli.plan import plan
from handeye_cli.records import Stations
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.scene import scene_of, scene_of_plan


def robot(setup):
    return np.stack([each.base_T_gripper for each in cases.stations(setup).stations])


def test_moving_cameras_are_where_the_robot_carries_them():
    scene = scene_of(cases.case())
    cameras = robot(Setup.EYE_IN_HAND) @ cases.calibration().mount_T_camera.matrix
    np.testing.assert_allclose(cases.points_of_cameras(scene.cameras), cameras[:, :3, 3])
    np.testing.assert_allclose(scene.places, cameras[:, :3, 3])
    assert scene.frame == "base"
    assert len(scene.plates) == 1
    assert scene.used.all()


def test_a_camera_looks_along_its_own_z_axis():
    scene = scene_of(cases.case())
    cameras = robot(Setup.EYE_IN_HAND) @ cases.calibration().mount_T_camera.matrix
    middle_of_rim = scene.cameras[:, 4:, 0].mean(axis=1)
    ahead = middle_of_rim - cameras[:, :3, 3]
    np.testing.assert_allclose(
        ahead / np.linalg.norm(ahead, axis=1, keepdims=True), cameras[:, :3, 2], atol=1e-12
    )


def test_moving_plates_are_where_the_robot_carries_them():
    setup = Setup.EYE_TO_HAND
    scene = scene_of(cases.case(setup))
    np.testing.assert_allclose(scene.places, cases.target_in_base(setup)[:, :3, 3])
    assert len(scene.cameras) == 1
    assert len(scene.plates) == cases.COUNT
    camera = cases.calibration(setup).mount_T_camera.matrix[:3, 3]
    np.testing.assert_allclose(scene.cameras[0, 0, 0], camera)


def test_bars_join_the_pairs_of_the_answer():
    scene = scene_of(cases.case())
    pairs = np.array(cases.calibration().pairs)
    np.testing.assert_array_equal(scene.pairs, scene.places[pairs])


def test_without_an_answer_the_target_is_the_frame():
    scene = scene_of(Case("a", stations=cases.stations()))
    seen = np.stack([each.camera_T_target.matrix for each in cases.stations().stations])
    assert scene.frame == "target"
    np.testing.assert_allclose(scene.places, cases.inverse(seen)[:, :3, 3])
    assert len(scene.grippers) == 0


def test_an_unused_station_is_marked_and_a_lost_one_left_out():
    whole, answer = cases.stations(), cases.calibration()
    lost = replace(whole.stations[2], camera_T_target=None)
    rows = (*whole.stations[:2], lost, *whole.stations[3:])
    unused = replace(answer.stations[5], used=False)
    answer = replace(answer, stations=(*answer.stations[:5], unused, *answer.stations[6:]))
    scene = scene_of(Case("a", stations=replace(whole, stations=rows), calibration=answer))
    assert "02" not in scene.names
    assert [name for name, used in zip(scene.names, scene.used, strict=True) if not used] == ["05"]
    kept = [pair for pair in answer.pairs if 2 not in pair]
    assert len(scene.pairs) == len(kept)


def test_everything_is_inside_the_box():
    for setup in Setup:
        scene = scene_of(cases.case(setup))
        centres = np.concatenate([scene.places, scene.plates.reshape(-1, 3)])
        assert np.all((centres >= scene.low) & (centres <= scene.high))


def test_the_plate_has_its_size():
    scene = scene_of(cases.case())
    edges = np.linalg.norm(np.diff(scene.plates[0], axis=0), axis=1)
    assert np.all((edges >= 0.025) & (edges < 0.05))  # 6x6 discs 5 mm apart, and a margin


def test_of_very_many_stations_some_are_shown():
    few = cases.stations()
    many = tuple(replace(few.stations[i % cases.COUNT], name=str(i)) for i in range(250))
    scene = scene_of(Case("a", stations=replace(few, stations=many)))
    assert scene.total == 250
    assert len(scene.names) == 100
    assert (scene.names[0], scene.names[-1]) == ("0", "249")


def test_a_plan_stands_around_its_target():
    planned = plan(5, distance=0.17, tilt=np.radians(30), verification=2)
    scene = scene_of_plan(planned)
    wanted = np.stack([each.target_T_camera[:3, 3] for each in planned.stations])
    np.testing.assert_allclose(cases.points_of_cameras(scene.cameras), wanted)
    assert scene.used.sum() == 5
    assert len(scene.pairs) == len(planned.pairs)


@pytest.mark.parametrize("stations", [None, Stations(Setup.EYE_IN_HAND, ())])
def test_without_poses_there_is_no_scene(stations):
    assert scene_of(Case("a", stations=stations)) is None
