"""Recordings of an invented robot whose truth is known, and a writer for any MCAP."""

from dataclasses import dataclass, field

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from recording import ros2
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import se3

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
PAUSE = 1.0
MOVE = 0.8
PERIOD = PAUSE + MOVE
SIZE = (48, 64)
MOVING_GREY = 255
K = (600.0, 0.0, 31.5, 0.0, 610.0, 23.5, 0.0, 0.0, 1.0)

LAYOUTS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "plain": {"compression": CompressionType.NONE},
    "small-chunks": {"compression": CompressionType.NONE, "chunk_size": 2000},
    "no-chunks": {"use_chunking": False},
    "no-index": {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False},
    "no-crc": {"compression": CompressionType.NONE, "enable_crcs": False},
}


def ns(seconds):
    return START + round(seconds * SECOND)


def write(path, messages, schemas=None, *, silent=(), **options):
    """Write (log time, topic, schema name, payload) in this order; return the path as text.

    `schemas` replaces (message encoding, schema encoding, schema text) of topics. Of the messages
    `silent` only the topics are written.
    """
    with path.open("wb") as file:
        writer = Writer(file, **{"chunk_size": 64_000, **options})
        writer.start(profile="ros2", library="test")
        channels = {}
        for index, (log_ns, topic, schema, payload) in enumerate([*silent, *messages]):
            if topic not in channels:
                text = ros2.TEXTS.get(schema.replace("/msg/", "/"), "")
                encoding, form, text = (schemas or {}).get(topic, ("cdr", "ros2msg", text))
                schema_id = writer.register_schema(schema, form, text.encode())
                channels[topic] = writer.register_channel(topic, encoding, schema_id)
            if index >= len(silent):
                writer.add_message(channels[topic], log_ns, payload, log_ns)
        writer.finish()
    return str(path)


def pose_numbers(T):
    return (*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat())


def random_pose(rng, reach=0.3, turn=0.6):
    return se3.from_parts(
        Rotation.from_rotvec(rng.uniform(-turn, turn, 3)).as_matrix(), rng.uniform(-reach, reach, 3)
    )


def _blend(A, B, s):
    """Pose on the way from A (s = 0) to B (s = 1)."""
    turn = Rotation.from_matrix(A[:3, :3].T @ B[:3, :3]).as_rotvec()
    R = A[:3, :3] @ Rotation.from_rotvec(s * turn).as_matrix()
    return se3.from_parts(R, (1 - s) * A[:3, 3] + s * B[:3, 3])


@dataclass
class Robot:
    """Stands still for a second at every station and moves on smoothly.

    Its two moving links are published at different times, with the noise of a good robot.
    """

    seed: int = 1
    stations: int = 4
    noise: float = 1e-4
    rate: float = 100.0
    image_rate: float = 20.0
    image_topic: str = "/camera/image_raw"
    encoding: str = "mono8"
    stamp_offset: float = 0.0
    image_delay: float = 0.03
    upper: list = field(init=False)
    lower: list = field(init=False)

    def __post_init__(self):
        self.rng = np.random.default_rng(self.seed)
        self.upper = [random_pose(self.rng) for _ in range(self.stations)]
        self.lower = [random_pose(self.rng) for _ in range(self.stations)]

    @property
    def duration(self):
        return self.stations * PERIOD - MOVE

    def station_pose(self, index):
        return self.upper[index] @ self.lower[index]

    def _at(self, poses, t):
        index = min(int(t / PERIOD), self.stations - 1)
        s = np.clip((t - index * PERIOD - PAUSE) / MOVE, 0.0, 1.0)
        smooth = s**3 * (10 - 15 * s + 6 * s**2)
        return _blend(poses[index], poses[min(index + 1, self.stations - 1)], smooth)

    def noisy(self, poses, t):
        return se3.perturb(self._at(poses, t), self.rng.normal(0.0, self.noise, 6))

    def moving(self, t):
        return t % PERIOD >= PAUSE

    def grey(self, t):
        return MOVING_GREY if self.moving(t) else 40 + 10 * int(t / PERIOD)

    def links(self):
        for t in np.arange(0.0, self.duration, 1 / self.rate):
            shifted = t + 0.3 / self.rate
            upper = pose_numbers(self.noisy(self.upper, t))
            lower = pose_numbers(self.noisy(self.lower, shifted))
            payload = ros2.transforms((ns(t), "base_link", "link_1", upper))
            yield ns(t + 0.002), "/tf", "tf2_msgs/msg/TFMessage", payload
            payload = ros2.transforms((ns(shifted), "link_1", "wrist", lower))
            yield ns(shifted + 0.002), "/tf", "tf2_msgs/msg/TFMessage", payload

    def static(self):
        still = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0)
        payload = ros2.transforms(
            (ns(0), "/world", "/base_link", still), (ns(0), "wrist", "camera_optical", still)
        )
        return [(ns(0), "/tf_static", "tf2_msgs/msg/TFMessage", payload)]

    def images(self):
        for t in np.arange(0.01, self.duration, 1 / self.image_rate):
            pixels = np.full(SIZE, self.grey(t), dtype=np.uint8)
            stamp = ns(t + self.stamp_offset)
            payload = ros2.image(stamp, "camera_optical", pixels, self.encoding)
            yield ns(t + self.image_delay), self.image_topic, "sensor_msgs/msg/Image", payload

    def infos(self):
        info = "/".join([*self.image_topic.split("/")[:-1], "camera_info"])
        for t in np.arange(0.01, self.duration, 0.5):
            payload = ros2.camera_info(ns(t), "camera_optical", k=K, d=(0.1, -0.2, 0.0, 0.0, 0.0))
            yield ns(t), info, "sensor_msgs/msg/CameraInfo", payload

    def messages(self):
        return in_order(self.static(), self.links(), self.images(), self.infos())

    def world_T_wrist(self, index):
        return se3.from_parts(np.eye(3), np.array([0.0, 0.0, 0.1])) @ self.station_pose(index)


def in_order(*streams):
    return sorted((message for stream in streams for message in stream), key=lambda m: m[0])
