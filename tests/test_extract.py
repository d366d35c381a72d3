import threading
import time
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import pytest
from targets.rendering import bitmap, chessboard, discs, pose_view, project, render

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.extract import extract
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Finding, RecordedStation, Recording
from handeye_cli.simulate.recording import Rig, simulate_recording

CAMERA = Camera(320, 240, 350.0, 350.0, 160.0, 120.0)


@dataclass(frozen=True)
class Picture:
    """An image in memory that counts how many are held at the same time."""

    image: np.ndarray | None
    label: str = "picture"
    held: list[int] = field(default_factory=lambda: [0, 0])
    lock: threading.Lock = field(default_factory=threading.Lock)

    def load(self):
        if self.image is None:
            raise InputError("expected an image, found no data", where=self.label)
        return self.image.copy()


def recording_of(text, images, **more):
    stations = tuple(
        RecordedStation(f"{k:02d}", np.eye(4), image) for k, image in enumerate(images)
    )
    target = None if text is None else targets.parse(text)
    return Recording(Setup.EYE_IN_HAND, stations, target, CAMERA, **more)


def board_image(roll):
    H = pose_view((8, 5), distance=20, tilt=20, roll=roll)
    return render(chessboard(9, 6, 1.0), H), H


def test_every_station_is_kept_in_order_with_its_points_or_a_reason():
    image, H = board_image(8)
    pictures = [
        Picture(image),
        Picture(None, "images/1.png"),
        Picture(np.zeros((480, 640), np.uint8)),
        Picture(np.full((240, 320), 99, np.uint8)),
        Picture(image),
    ]
    finding = Finding("note", "info", "kept")
    recording = recording_of("chessboard:9x6:1mm", pictures, findings=(finding,))

    features = extract(recording, workers=2)

    assert [station.name for station in features.stations] == ["00", "01", "02", "03", "04"]
    found = [station.observation is not None for station in features.stations]
    assert found == [True, False, False, False, True]
    truth = project(H, targets.build(features.target).points() * 1000)
    np.testing.assert_allclose(features.stations[0].observation.pixels, truth, atol=0.2)
    reasons = [station.reason for station in features.stations]
    assert reasons[0] is None
    assert reasons[1] == "images/1.png: expected an image, found no data"
    assert "320x240" in reasons[2]
    assert "640x480" in reasons[2]
    assert reasons[3] == (
        "no chessboard of 9x6 inner corners was found: the image has nothing but grey levels "
        "from 99 to 99"
    )
    kept, unused = features.findings
    assert kept is finding
    assert unused.code == "images-unused"
    assert unused.message.startswith("3 of 5 images are not used: 01: images/1.png: expected")
    assert (features.setup, features.camera, features.target) == (
        recording.setup, recording.camera, recording.target,
    )  # fmt: skip


def test_without_a_camera_the_images_tell_their_size():
    image, _ = board_image(8)
    other = np.full((480, 640), 99, np.uint8)
    pictures = [Picture(other), Picture(image), Picture(None), Picture(image)]
    recording = replace(recording_of("chessboard:9x6:1mm", pictures), camera=None)
    features = extract(recording)
    assert features.image_size == (320, 240)
    assert features.stations[1].observation is not None
    assert features.stations[0].reason == (
        "expected an image of 320x240 as most of the recording's, found one of 640x480"
    )
    assert extract(replace(recording, stations=recording.stations[2:3])).image_size is None


def test_the_number_of_workers_does_not_change_the_result():
    rng = np.random.default_rng(0)
    centres = targets.build(targets.parse("disc-grid:6x6:5mm:2.5mm:4mm")).points()[:, :2] * 1000
    diameters = np.where(np.arange(36) == 0, 4.0, 2.5)
    pictures = []
    for seed in range(5):
        H = pose_view((25, 25), distance=70, tilt=rng.uniform(0, 40), roll=rng.uniform(0, 360))
        pictures.append(Picture(render(discs(centres, diameters), H, samples=2, seed=seed)))
    recording = recording_of("disc-grid:6x6:5mm:2.5mm:4mm", pictures)
    one, many = extract(recording, workers=1), extract(recording, workers=4)
    for a, b in zip(one.stations, many.stations, strict=True):
        assert a.observation is not None
        np.testing.assert_array_equal(a.observation.ids, b.observation.ids)
        np.testing.assert_array_equal(a.observation.pixels, b.observation.pixels)


def test_progress_is_told_after_each_image():
    told = []
    pictures = [Picture(np.full((240, 320), 99, np.uint8)) for _ in range(4)]
    recording = recording_of("apriltag:36h11:1mm", pictures)
    extract(recording, workers=2, progress=lambda done, every: told.append((done, every)))
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]


class Counted(np.ndarray):
    """An image that says when it is gone."""

    def __del__(self):
        alive.discard(self.tag) if hasattr(self, "tag") else None


alive = set()


@dataclass(frozen=True)
class Held:
    tag: int
    most: list
    label: str = "held"

    def load(self):
        image = np.zeros((240, 320), np.uint8).view(Counted)
        image.tag = self.tag
        alive.add(self.tag)
        self.most.append(len(alive))
        time.sleep(0.01)
        return image


@pytest.mark.parametrize("workers", [1, 3])
def test_no_more_images_than_workers_are_in_memory(workers):
    most = []
    recording = recording_of("apriltag:36h11:1mm", [Held(k, most) for k in range(12)])
    extract(recording, workers=workers)
    assert len(most) == 12
    assert max(most) <= workers


@pytest.mark.parametrize(
    "text", [targets.board_class(name).EXAMPLE for name in targets.TYPES], ids=targets.TYPES
)
def test_the_fault_of_an_image_is_told_once_whatever_the_target(text):
    image, _ = board_image(8)
    pictures = [
        Picture(np.zeros((240, 320), np.uint8)),
        Picture(cv2.GaussianBlur(image, (0, 0), 9.0)),
        Picture(np.zeros((1, 1), np.uint8)),
    ]
    recording = replace(recording_of(text, pictures), camera=None)
    dark, soft, tiny = (station.reason for station in extract(recording).stations)
    assert dark.count("the image has nothing but grey levels from 0 to 0, it is too dark") == 1
    assert soft.count("the image is blurred, its sharpest edge is") == 1
    assert "found one of 1x1" in tiny


def test_a_recording_without_a_target_asks_for_one():
    recording = recording_of(None, [Picture(None)])
    with pytest.raises(UsageError, match="add --target, such as disc-grid:6x6:5mm:4mm or"):
        extract(recording)


def test_no_worker_is_refused():
    recording = recording_of("apriltag:36h11:1mm", [])
    with pytest.raises(UsageError, match="at least 1 worker, found 0"):
        extract(recording, workers=0)


def test_a_bug_in_a_source_is_not_hidden():
    class Broken:
        label = "broken"

        def load(self):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        extract(recording_of("apriltag:36h11:1mm", [Broken()]))


def test_a_plate_that_looks_the_same_after_a_turn_is_numbered_alike_in_all_images():
    rng = np.random.default_rng(3)
    text = "disc-grid:6x6:5mm:3mm"
    points = targets.build(targets.parse(text)).points()
    gripper_T_camera = se3.from_parts(rotations.exp(np.array([0.1, -0.2, 0.3])),
                                      np.array([0.02, 0.03, 0.05]))  # fmt: skip
    K = np.array([[350.0, 0, 160], [0, 350, 120], [0, 0, 1]])
    stations, views = [], []
    for k, roll in enumerate([0, 70, 140, 210, 280, 350]):
        tilt, about = np.radians(25), rng.uniform(0, 2 * np.pi)
        axis = np.array([np.cos(about), np.sin(about), 0])
        R = rotations.exp(tilt * axis) @ rotations.exp(np.array([0, 0, np.radians(roll)]))
        t = np.array([0, 0, 0.065]) - R @ points.mean(axis=0)
        H = K @ np.column_stack([R[:, 0] / 1000, R[:, 1] / 1000, t])
        camera_T_target = se3.from_parts(R, t)
        base_T_gripper = se3.inverse(gripper_T_camera @ camera_T_target)
        image = render(discs(points[:, :2] * 1000, 3.0), H, samples=3, seed=k)
        stations.append(RecordedStation(str(k), base_T_gripper, Picture(image)))
        views.append(H)
    recording = replace(recording_of(text, []), stations=tuple(stations))

    features = extract(recording, workers=2)

    turns = targets.build(features.target).turns()
    readings = [
        [
            np.abs(
                station.observation.pixels - project(H, points[turn][station.observation.ids] * 1e3)
            ).max()
            for turn in turns
        ]
        for station, H in zip(features.stations, views, strict=True)
    ]
    assert np.min(readings, axis=1).max() < 0.3
    # each by itself would start at the top left of its image; the robot says which corner is which
    assert len(set(np.argmin(readings, axis=1))) == 1


def test_a_target_seen_in_part_keeps_its_ids():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    marker = cv2.aruco.generateImageMarker(dictionary, 1, 7)
    H = pose_view((2.4, 1.0), distance=6)
    image = render(bitmap(marker, 1.4, 0.0, 1.0, 1.0), H)
    features = extract(recording_of("aruco-grid:DICT_5X5_100:2x1:1mm:0.4mm", [Picture(image)]))
    assert features.stations[0].observation.ids.tolist() == [4, 5, 6, 7]


@pytest.mark.parametrize("legacy", [False, True])
def test_an_open_layout_is_settled_by_the_images_and_told(legacy):
    """A ChArUco board with an even number of rows, whose maker's OpenCV nobody remembers."""
    said = targets.parse("charuco:5x6:20mm:14mm:DICT_5X5_50")
    printed = replace(said, parameters={**said.parameters, "legacy": legacy})
    board = targets.build(printed)
    centre = board.points().mean(axis=0)
    places = generate_stations(3, 0.35, np.radians(20.0), centre)
    rig = Rig(printed, Camera(480, 360, 600.0, 600.0, 240.0, 180.0), np.eye(4), np.eye(4))
    recording = simulate_recording(rig, places, 3).recording
    features = extract(replace(recording, target=said))
    assert [station.reason for station in features.stations] == [None] * 3
    assert features.target.parameters["legacy"] is legacy
    assert [finding.code for finding in features.findings] == ["charuco-layout"]
    assert f"legacy: {str(legacy).lower()}" in features.findings[0].advice
    assert extract(replace(recording, stations=recording.stations[:1])).findings == ()
