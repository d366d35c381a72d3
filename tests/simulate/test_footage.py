"""What robot and camera send: the document's poses at the pauses, true pictures all the way."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulate.small_rig import RIG, taken

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.records import Noise
from handeye_cli.simulate.footage import START_NS, Footage, Shooting
from handeye_cli.simulate.motion import SECOND_NS
from handeye_cli.simulate.recording import Rig
from handeye_cli.simulate.render import Appearance

SHOOTING = Shooting(image_rate=10.0, pose_rate=50.0, pause_ns=SECOND_NS // 2)


def filmed(*faults: str, rig: Rig = RIG, shooting: Shooting = SHOOTING, count: int = 4):
    simulated = taken(rig, count, faults=faults)
    return simulated, Footage(simulated, shooting)


def matrices(samples):
    R = Rotation.from_quat(samples.numbers[:, 3:]).as_matrix()
    return se3.from_parts(R, samples.numbers[:, :3])


def at_station(footage, times, index):
    arrivals, departures = footage.timetable.arrivals_ns, footage.timetable.departures_ns
    return (times >= arrivals[index]) & (times <= departures[index])


def test_robot_tells_at_a_pause_what_the_document_says():
    simulated, footage = filmed("robot-scale:1.01")
    _, moving = footage.links()
    poses = matrices(moving)
    for index, station in enumerate(simulated.recording.stations):
        there = at_station(footage, moving.stamps_ns, index)
        assert there.sum() >= 25
        expected = np.broadcast_to(station.base_T_gripper, poses[there].shape)
        assert poses[there] == pytest.approx(expected, abs=1e-12)


def test_links_are_a_still_base_and_a_moving_gripper():
    _, footage = filmed()
    still, moving = footage.links()
    assert (still.parent, still.child, still.static) == ("world", "base_link", True)
    assert (moving.parent, moving.child, moving.static) == ("base_link", "tool0", False)
    assert still.numbers.tolist() == [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
    assert np.diff(moving.stamps_ns).tolist() == [20_000_000] * (len(moving.stamps_ns) - 1)
    assert moving.stamps_ns[0] == START_NS
    assert np.all(moving.log_times_ns > moving.stamps_ns)


@pytest.mark.parametrize("setup", list(Setup))
def test_loop_is_closed_in_motion_too(setup):
    """A noiseless robot's pose and the picture's pose of the target give the same constant."""
    rig = replace(RIG, setup=setup, noise=Noise())
    # half a period of the pictures is one of the poses, so each picture has a pose of its time
    _, footage = filmed(rig=rig, shooting=replace(SHOOTING, image_rate=50.0, pose_rate=100.0))
    _, moving = footage.links()
    times, seen = footage.taken
    simultaneous = np.isin(moving.stamps_ns, times)
    assert simultaneous.sum() == len(times)
    robot = matrices(moving)[simultaneous]
    reference_T_mount = robot if setup is Setup.EYE_IN_HAND else se3.inverse(robot)
    closed = reference_T_mount @ rig.mount_T_camera @ seen
    expected = np.broadcast_to(rig.reference_T_target, closed.shape)
    assert closed == pytest.approx(expected, abs=1e-12)


def test_pictures_are_those_of_the_pauses_and_of_the_way_between():
    simulated, footage = filmed(rig=replace(RIG, appearance=Appearance()))
    shown = list(footage.pictures())
    stamps = np.array([stamp for stamp, _ in shown])
    assert footage.picture_count == len(shown)
    assert np.diff(stamps).tolist() == [100_000_000] * (len(stamps) - 1)
    for index, station in enumerate(simulated.recording.stations):
        expected = station.image.load()
        there = np.flatnonzero(at_station(footage, stamps, index))
        assert len(there) >= 4
        assert all(np.array_equal(shown[k][1], expected) for k in there)
    between = stamps > footage.timetable.departures_ns[0] + 200_000_000
    on_the_way = shown[int(np.argmax(between))][1]
    assert not np.array_equal(on_the_way, simulated.recording.stations[0].image.load())


def test_pictures_of_one_pause_differ_by_their_noise_alone():
    _, footage = filmed()
    first, second = (picture.astype(float) for _, picture in list(footage.pictures())[:2])
    difference = (second - first).ravel()
    # noise of 1 level and rounding in both; 7200 pixels tell their standard deviation to 1 %
    assert difference.std() == pytest.approx(np.sqrt(2 * (1 + 1 / 12)), rel=0.05)
    again = next(filmed()[1].pictures())[1]
    assert np.array_equal(first, again)


def test_late_images_have_late_stamps_and_the_same_pictures():
    _, on_time = filmed()
    _, late = filmed("time-offset:40ms")
    pairs = list(zip(on_time.pictures(), late.pictures(), strict=True))
    assert {after - before for (before, _), (after, _) in pairs} == {40_000_000}
    assert all(np.array_equal(one, other) for (_, one), (_, other) in pairs)


def test_a_dropped_station_has_no_pictures_around_it():
    _, footage = filmed("dropped:1,3")
    stamps = np.array([stamp for stamp, _ in footage.pictures()])
    nearest = np.rint(footage.timetable.places(stamps))
    assert set(nearest) == {0.0, 2.0}
    assert footage.picture_count == len(stamps)


def test_swapped_stations_show_each_other_while_the_robot_rests():
    simulated, footage = filmed("swapped:1,2", rig=replace(RIG, appearance=Appearance()))
    stamps = np.array([stamp for stamp, _ in footage.pictures()])
    pictures = [picture for _, picture in footage.pictures()]
    for index in range(4):
        expected = simulated.recording.stations[index].image.load()
        there = np.flatnonzero(at_station(footage, stamps, index))
        assert all(np.array_equal(pictures[k], expected) for k in there)


def test_a_plate_is_moved_half_way_to_its_station():
    _, before = filmed()
    _, after = filmed("moved-plate:2:3mm")
    times, expected = before.taken
    _, found = after.taken
    moved = se3.from_parts(np.eye(3), np.array([3e-3, 0.0, 0.0]))
    late = before.timetable.places(times) >= 1.5
    assert found[~late] == pytest.approx(expected[~late], abs=1e-15)
    assert found[late] == pytest.approx(expected[late] @ moved, abs=1e-15)
    assert 0 < late.sum() < len(late)


@pytest.mark.parametrize("rate", [0.0, -5.0])
def test_pictures_and_poses_without_a_rate_are_refused(rate):
    _, footage = filmed(shooting=replace(SHOOTING, image_rate=rate, pose_rate=rate))
    message = f"expected a rate above 0 Hz, found {rate:g} Hz"
    with pytest.raises(UsageError, match=message):
        next(footage.pictures())
    with pytest.raises(UsageError, match=message):
        footage.links()


def test_a_run_without_a_pause_is_refused():
    with pytest.raises(UsageError, match="found 0 s"):
        filmed(shooting=replace(SHOOTING, pause_ns=0))
