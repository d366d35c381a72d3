"""The recordings the line is run on, and the same stations as a robot's MCAP."""

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import pytest
from recording import ros2
from recording.bags import PERIOD, Robot, ns, pose_numbers

from handeye_cli import documents
from handeye_cli.geometry import rotations, se3

CHECKOUT = Path(__file__).resolve().parents[2]
SAMPLE = CHECKOUT / "sample_data" / "paper-plate"
SHARED = (CHECKOUT / ".." / "shared" / "data").resolve()

NOISE = 2e-5
"""Of a sensor's pose, per axis, m and rad."""
PEDESTAL = se3.from_parts(rotations.exp(np.array([0.0, 0.0, 0.7])), np.array([0.3, -0.2, 0.8]))
"""The static link: the robot's base in the world."""


def shared(name):
    """A real recording as a test's parameter, which is skipped where the recording is not there."""
    path = SHARED / name / "recording.yaml"
    missing = pytest.mark.skipif(not path.exists(), reason=f"no shared/data/{name} here")
    return pytest.param(path, id=name, marks=missing)


TARGETS = [pytest.param(SAMPLE / "recording.yaml", id="paper-plate"), shared("rct-charuco")]
"""A recording with each kind of target that there is one of."""


def pngs_of(path):
    """The files of a recording's images, in the order of its stations."""
    return [station.image.path.read_bytes() for station in documents.read(str(path)).stations]


@dataclass
class RecordedRobot(Robot):
    """A robot that visits the stations of a recording document, with its camera running.

    While it moves the pictures are black; a pause shows the station's own picture. The base stands
    still in the world, so the poses of the document are those of `tool` in `world`.
    """

    document: Path = SAMPLE / "recording.yaml"
    inverted: bool = False
    raw: bool = False
    noise: float = NOISE
    rate: float = 50.0
    image_rate: float = 5.0
    pictures: list = field(init=False)

    def __post_init__(self):
        self.rng = np.random.default_rng(self.seed)
        recorded = documents.read(str(self.document))
        self.camera = recorded.camera
        poses = np.stack([station.base_T_gripper for station in recorded.stations])
        poses = se3.inverse(poses) if self.inverted else poses
        self.lower = list(se3.inverse(PEDESTAL) @ poses)
        self.stations = len(self.lower)
        self.pictures = pngs_of(self.document)

    def static(self):
        link = (ns(0), "world", "base_link", pose_numbers(PEDESTAL))
        return [(ns(0), "/tf_static", "tf2_msgs/msg/TFMessage", ros2.transforms(link))]

    def links(self):
        for t in np.arange(0.0, self.duration, 1 / self.rate):
            pose = pose_numbers(self.noisy(self.lower, t))
            payload = ros2.transforms((ns(t), "base_link", "tool", pose))
            yield ns(t + 0.002), "/tf", "tf2_msgs/msg/TFMessage", payload

    def images(self):
        black = self._black()
        for t in np.arange(0.01, self.duration, 1 / self.image_rate):
            picture = black if self.moving(t) else self.pictures[int(t / PERIOD)]
            yield ns(t + self.image_delay), *self._image(ns(t), picture)

    def _image(self, stamp, png):
        if self.raw:
            pixels = cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
            payload = ros2.image(stamp, "camera_optical", pixels)
            return "/camera/image_raw", "sensor_msgs/msg/Image", payload
        payload = ros2.compressed_image(stamp, "camera_optical", png, "mono8; png compressed")
        return "/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage", payload

    def _black(self):
        pixels = np.zeros((self.camera.height, self.camera.width), dtype=np.uint8)
        return cv2.imencode(".png", pixels)[1].tobytes()

    def infos(self):
        camera = self.camera
        k = (camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0)
        size = (camera.width, camera.height)
        for t in np.arange(0.01, self.duration, 0.5):
            payload = ros2.camera_info(ns(t), "camera_optical", k=k, d=camera.distortion, size=size)
            yield ns(t), "/camera/camera_info", "sensor_msgs/msg/CameraInfo", payload
