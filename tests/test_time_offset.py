"""Recordings of a robot in motion whose images are stamped by a known time too late or early."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from cli.conftest import handeye
from moving_scenes import Run, X, Z

from handeye_cli import documents, pipeline, recording
from handeye_cli.conventions import MM, MRAD, Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.geometry.time_offset import MovingViews
from handeye_cli.geometry.trajectory import Trajectory
from handeye_cli.pipeline import Steps
from handeye_cli.recording import McapOptions, writing
from handeye_cli.records import Camera, Noise, TargetSpec
from handeye_cli.simulate import default_rig
from handeye_cli.simulate.faults import parse
from handeye_cli.simulate.footage import Footage, Shooting
from handeye_cli.simulate.motion import SECOND_NS
from handeye_cli.simulate.recording import Rig, simulate_recording
from handeye_cli.simulate.render import Appearance
from handeye_cli.time_offset import Doubt, extract_in_motion, fitted

__all__ = ["handeye"]

MS = 1e-3
TARGET = "disc-grid:4x4:20mm:14mm"
PLATE = TargetSpec("disc-grid", {"rows": 4, "columns": 4, "spacing_mm": 20, "diameter_mm": 14})
CENTRE = np.array([0.03, 0.03, 0.0])
ONE = Steps(workers=1)


def rig(setup):
    return Rig(
        target=PLATE,
        camera=Camera(200, 160, 190.0, 190.0, 99.5, 79.5),
        mount_T_camera=default_rig.mount_T_camera(setup),
        reference_T_target=default_rig.reference_T_target(setup),
        setup=setup,
        noise=Noise(robot_rotation=1e-6, robot_translation=1e-6),
        appearance=Appearance(noise=6.0),
    )


def filmed(path, lag, *, setup=Setup.EYE_IN_HAND, pause=0.01, stops=4, jitter=0.0):
    """Write what a robot sends on its way around the plate; return the path as text.

    Stamps are late by `lag`, and each by a time of its own besides, of standard deviation `jitter`.
    """
    around = generate_stations(stops, 0.17, np.radians(30), CENTRE)
    nearer = se3.from_parts(np.eye(3), [[0.0, 0.0, 0.01 * (k % 3)] for k in range(stops)])
    turned = rotations.exp([[0.0, 0.0, 0.4 * (k % 2)] for k in range(stops)])
    cameras = around @ nearer @ se3.from_parts(turned, np.zeros(3))
    simulated = simulate_recording(rig(setup), cameras, 4, faults=[parse(f"time-offset:{lag}")])
    footage = Footage(simulated, Shooting(6.0, 100.0, round(pause * SECOND_NS)))
    rng = np.random.default_rng(5)
    pictures = (
        (stamp + round(jitter * SECOND_NS * rng.standard_normal()), image)
        for stamp, image in footage.pictures()
    )
    with path.open("wb") as file:
        writing.write(file, writing.Streams(footage.camera, pictures, footage.links()))
    return str(path)


@pytest.fixture(scope="module")
def restless(tmp_path_factory):
    return filmed(tmp_path_factory.mktemp("restless") / "robot.mcap", "38ms")


@pytest.fixture(scope="module")
def pausing(tmp_path_factory):
    return filmed(tmp_path_factory.mktemp("pausing") / "robot.mcap", "38ms", pause=0.7)


def read(path, setup=Setup.EYE_IN_HAND, **options):
    return recording.read(path, McapOptions(setup=setup, target=PLATE, **options))


def found_in(path, **options):
    record = read(path, **options)
    return extract_in_motion(record, record.moving, workers=1)


@pytest.fixture(scope="module")
def record(restless):
    return read(restless)


@pytest.fixture(scope="module")
def found(record):
    """The features and what they tell of the time."""
    return extract_in_motion(record, record.moving, workers=1)


def test_a_robot_that_never_pauses_is_calibrated_from_its_way(restless):
    calibration = pipeline.to_calibration(
        read(restless), ONE, method="maximum-likelihood", pairs="star"
    )
    away = se3.difference(
        calibration.mount_T_camera.matrix, default_rig.mount_T_camera(Setup.EYE_IN_HAND)
    )
    error = calibration.predicted_error
    # 95 % of answers are within these radii; one in a thousand is 1.5 times as far away
    assert np.linalg.norm(away[3:]) < 1.5 * error.rotation_95 < 2 * MRAD
    assert np.linalg.norm(away[:3]) < 1.5 * error.translation_95 < 0.5 * MM
    told = {finding.code: finding for finding in calibration.diagnosis}
    assert told["stations-moving"].severity == "warning"
    assert told["time-offset"].severity == "info"
    said = told["time-offset"].message
    assert said.startswith("images lag behind the robot's poses by ")
    assert said.endswith("this is put right")
    assert float(said.split()[7]) == pytest.approx(38.0, abs=0.5)


def test_the_offset_it_was_found_with_is_right(record, found):
    features, measured = found
    assert abs(measured.offset.offset + 38 * MS) < 4 * measured.offset.sigma < 1 * MS
    assert 20 <= measured.offset.frames <= 60
    corrected = np.array([station.base_T_gripper for station in features.stations])
    times = record.moving.times[record.moving.stations] + measured.offset.offset
    np.testing.assert_allclose(corrected, record.moving.path.at(times), atol=1e-9)


def test_a_pose_is_as_uncertain_as_its_time_makes_it(record, found):
    features, measured = found
    times = record.moving.times[record.moving.stations] + measured.offset.offset
    velocities = record.moving.path.velocities(times)
    speeds = np.linalg.norm(velocities, axis=1)
    sigmas = [np.sqrt(np.trace(station.robot_covariance)) for station in features.stations]
    np.testing.assert_allclose(sigmas, speeds * measured.offset.jitter, rtol=1e-9)
    assert max(sigmas) > 2 * min(sigmas)
    shared = np.array([station.shared_error for station in features.stations])
    np.testing.assert_allclose(shared, measured.offset.sigma * velocities, rtol=1e-9)


def test_a_given_offset_is_where_the_search_starts(restless):
    _, measured = found_in(restless, time_offset_ns=-63_000_000)
    assert abs(measured.offset.offset + 38 * MS) < 4 * measured.offset.sigma
    assert measured.offset.given == -63 * MS


def test_a_camera_beside_the_robot_whose_images_come_early(tmp_path):
    path = filmed(tmp_path / "a.mcap", "-25ms", setup=Setup.EYE_TO_HAND)
    _, measured = found_in(path, setup=Setup.EYE_TO_HAND)
    assert abs(measured.offset.offset - 25 * MS) < 4 * measured.offset.sigma < 1 * MS
    assert "images run ahead of the robot's poses by 25" in measured.finding.message


@pytest.fixture(scope="module")
def inspection(pausing):
    return pipeline.to_inspection(read(pausing), ONE)


def test_pauses_stay_the_stations_and_inspect_tells_the_offset(inspection):
    assert len(inspection.stations) == 4
    offset = inspection.time_offset
    assert abs(offset.offset + 38 * MS) < 4 * offset.sigma < 1 * MS
    (finding,) = [each for each in inspection.diagnosis if each.code == "time-offset"]
    # a pause begins and ends a tenth of a second later and earlier than the standstill
    assert finding.severity == "info"
    flag = finding.advice.split()[1]
    assert finding.advice.startswith(f"--time-offset {flag} puts it right; ")
    assert abs(float(flag.removesuffix("ms")) + 38.0) < 1.0


def test_stamps_that_scatter_are_what_limits_an_answer_from_motion(handeye, tmp_path):
    path = filmed(tmp_path / "a.mcap", "38ms", jitter=4 * MS)
    words = (path, "--setup", "eye-in-hand", "--target", TARGET, "--workers", 1)
    shown = handeye("inspect", *words, "-o", tmp_path / "a.yaml", terminal=True)
    looked = documents.read(str(tmp_path / "a.yaml"))
    assert looked.blame.limit == "timing"
    assert looked.blame.words.endswith("the time between pose and image is the limit")
    assert min(looked.blame.timing_rotation, looked.blame.timing_translation) > 0.5
    assert "the time between pose and image is the limit" in " ".join(shown.out.split())
    # forty times tell their scatter to 11 %
    assert looked.time_offset.jitter == pytest.approx(4 * MS, rel=0.4)


def test_right_stamps_and_pauses_do_not_limit_it(restless, inspection):
    restless = pipeline.to_inspection(read(restless), ONE)
    assert restless.blame.limit != "timing"
    assert 0.0 < restless.blame.timing_rotation < 0.05
    # the offset that was found is not applied to pauses, and they do not move
    assert inspection.time_offset is not None
    assert inspection.blame.timing_rotation is None


def test_an_offset_that_reaches_into_pauses_is_a_warning(pausing):
    record = read(pausing, time_offset_ns=82_000_000)
    _, measured = extract_in_motion(record, record.moving, workers=1)
    assert measured.finding.severity == "warning"
    assert abs(measured.offset.offset + 38 * MS) < 4 * measured.offset.sigma


def test_the_flag_of_the_advice_is_understood_and_ends_the_matter(
    handeye, pausing, inspection, tmp_path
):
    words = (pausing, "--setup", "eye-in-hand", "--target", TARGET, "--workers", 1)
    (finding,) = [each for each in inspection.diagnosis if each.code == "time-offset"]
    flags = finding.advice.split()[:2]
    shown = handeye("inspect", *words, *flags, "-o", tmp_path / "a.yaml", terminal=True)
    assert "Time between images and poses, from" in shown.out
    assert "as given" in shown.out
    again = documents.read(str(tmp_path / "a.yaml"))
    (finding,) = [each for each in again.diagnosis if each.code == "time-offset"]
    assert (finding.severity, finding.advice) == ("info", "")
    assert again.time_offset.given == pytest.approx(inspection.time_offset.offset, abs=1 * MS)
    assert again.time_offset.offset == pytest.approx(again.time_offset.given, abs=1 * MS)


def test_frames_in_motion_can_be_asked_for(handeye, pausing):
    words = (pausing, "--setup", "eye-in-hand", "--target", TARGET, "--moving")
    done = handeye("extract", *words)
    assert done.code == 0, done.err
    assert "4 pauses of the robot with images: " in done.err
    assert "time-offset" in done.err


def test_the_line_in_steps_says_the_same(handeye, restless, tmp_path):
    words = (restless, "--setup", "eye-in-hand", "--target", TARGET)
    features = tmp_path / "features.yaml"
    assert handeye("extract", *words, "-o", features).code == 0
    stepwise = json.loads(handeye("extrinsics", features, "--json").out)
    at_once = json.loads(handeye("extrinsics", *words, "--json").out)
    assert len(at_once["stations"][0]["base_T_gripper"]["covariance"]) == 6
    del stepwise["provenance"], at_once["provenance"]
    assert stepwise == at_once


@dataclass(frozen=True)
class Blank:
    """A frame that shows nothing."""

    label: str = "blank"

    def load(self):
        return np.full((160, 200), 128, dtype=np.uint8)


def hidden(moving, seen):
    """Return the frames, all but the first few of which show nothing."""
    frames = [
        frame if index < seen else replace(frame, image=Blank())
        for index, frame in enumerate(moving.frames)
    ]
    return replace(moving, frames=tuple(frames))


@pytest.mark.parametrize(("seen", "said"), [(0, "target in at least one"), (6, "fewer than 10")])
def test_frames_without_the_target_leave_the_times_as_they_are(record, seen, said):
    moving = hidden(record.moving, seen)
    features, measured = extract_in_motion(record, moving, workers=1)
    assert measured.offset is None
    assert measured.finding.code == "time-offset-unknown"
    assert measured.finding.severity == "warning"
    assert said in measured.finding.message
    for station, taken in zip(features.stations, record.stations, strict=True):
        np.testing.assert_array_equal(station.base_T_gripper, taken.base_T_gripper)


def test_a_robot_whose_images_are_of_another_time_is_told_of(record):
    moving = record.moving
    late = replace(
        moving, frames=moving.frames[::3], times=moving.times[::3] - 1.9, stations=np.arange(3)
    )
    _, measured = extract_in_motion(record, late, workers=1)
    assert measured.offset is None
    assert measured.finding.message.startswith("the time between images and poses is not told: ")
    assert "within 1 s do robot and camera make the same motions" in measured.finding.message
    assert "--time-offset" in measured.finding.advice


def part_of(path, middle, reach):
    inside = np.abs(path.times - middle) < reach
    return replace(path, times=path.times[inside], poses=path.poses[inside])


def with_moved_target(views):
    moved = views.B @ se3.from_parts(rotations.exp(np.array([0.0, 0.0, 0.4])), np.zeros(3))
    later = np.arange(len(views.times)) % 2 == 1
    return replace(views, B=np.where(later[:, None, None], moved, views.B))


CHANGES = {
    "too few": lambda views: views.part(np.arange(40) < 9),
    "of another time": lambda views: replace(views, times=views.times - 1.9),
    "a target that moves": with_moved_target,
    "the other setup": lambda views: replace(views, inverted=not views.inverted),
    "no poses": lambda views: replace(views, path=part_of(views.path, views.times[0], 0.05)),
    "late by chance": lambda views: replace(
        views, times=views.times + 0.1 * np.random.default_rng(2).standard_normal(40)
    ),
}


@pytest.mark.parametrize(
    ("change", "reason", "advice"),
    [
        ("too few", "fewer than 10 frames in motion show the target", "with the target in view"),
        ("of another time", "at none within 1 s do robot and camera make the same", "one clock"),
        ("a target that moves", "the same angles, but about axes that do not fit", "target and"),
        ("the other setup", "by the same angles, but about axes that do not fit", "--setup"),
        ("no poses", "the robot's poses are known at the times of ", "as long as the images"),
        ("late by chance", "the motion leaves it open by ", "about several"),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_the_reason_why_no_time_is_told_is_the_true_one(change, reason, advice, seed):
    changed = CHANGES[change](Run(np.random.default_rng(seed)).moving_views())
    doubt = fitted(lambda _: changed)
    assert isinstance(doubt, Doubt)
    assert reason in doubt.reason
    assert advice in doubt.advice


def test_a_turn_about_one_axis_leaves_the_time_open():
    rng = np.random.default_rng(2)
    times, taken = np.arange(0.0, 10.0, 0.01), np.linspace(1.0, 9.0, 30)
    axis = np.array([0.0, 0.0, 0.3])
    robot, then = (
        se3.from_parts(rotations.exp(t[:, None] * axis), np.zeros(3)) for t in (times, taken)
    )
    views = MovingViews(
        Trajectory(times, se3.perturb(robot, rng.normal(0.0, 1e-4, (1000, 6)))),
        inverted=False,
        times=taken,
        B=se3.perturb(se3.inverse(then @ X) @ Z, rng.normal(0.0, 1e-5, (30, 6))),
        covariance=np.tile(1e-10 * np.eye(6), (30, 1, 1)),
    )
    doubt = fitted(lambda _: views)
    assert isinstance(doubt, Doubt)
    assert "the motion leaves it open by " in doubt.reason


def test_a_frame_whose_corrected_time_is_outside_is_not_used(record):
    path, first = record.moving.path, record.moving.times[0]
    inside = path.times >= first - 0.02
    short = replace(path, times=path.times[inside], poses=path.poses[inside])
    features, measured = extract_in_motion(record, replace(record.moving, path=short), workers=1)
    assert measured.offset is not None
    assert features.stations[0].observation is None
    assert "at the corrected time is not known" in features.stations[0].reason
    assert features.stations[1].observation is not None
