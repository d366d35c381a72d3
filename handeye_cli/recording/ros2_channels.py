"""The topics of an MCAP file that we write as ROS 2 would, made with the first message of each."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

from mcap.writer import Writer

from handeye_cli.recording.cdr_writing import AnyWritten, encoded
from handeye_cli.recording.message_table import SCHEMAS
from handeye_cli.recording.messages import (
    CameraInfoMessage,
    CompressedImageMessage,
    ImageMessage,
    TransformsMessage,
)

PROFILE = "ros2"
"""What the header of such a file says."""
STATIC_TOPIC = "/tf_static"
"""Its messages reach also those who ask later."""

_TIME = f"{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
"""The one definition that our decoders have built in and that other tools may miss."""
_FOREVER = "\n    sec: 9223372036\n    nsec: 854775807"
_QUALITY = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {durability}\n"
    f"  deadline:{_FOREVER}\n  lifespan:{_FOREVER}\n"
    f"  liveliness: 1\n  liveliness_lease_duration:{_FOREVER}\n"
    "  avoid_ros_namespace_conventions: false\n"
)
"""A topic's quality of service in the words and numbers of rosbag2, which reads it for playing."""
_VOLATILE, _TRANSIENT_LOCAL = 2, 1
_SCHEMA_OF = {
    ImageMessage: "sensor_msgs/msg/Image",
    CompressedImageMessage: "sensor_msgs/msg/CompressedImage",
    CameraInfoMessage: "sensor_msgs/msg/CameraInfo",
    TransformsMessage: "tf2_msgs/msg/TFMessage",
}


@dataclass(frozen=True)
class Sent:
    """A message on its way into the file.

    Attributes:
        log_time_ns: When it is recorded.
        topic: Where it is sent.
        message: What is sent.
    """

    log_time_ns: int
    topic: str
    message: AnyWritten


class Ros2Channels:
    """Writes messages, each under its topic.

    Args:
        writer: Of a file that has been started.
    """

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def write(self, sent: Sent) -> None:
        """Append a message to the file."""
        if sent.topic not in self._channels:
            self._channels[sent.topic] = self._register(sent)
        count = self._counts[sent.topic] = self._counts.get(sent.topic, -1) + 1
        channel, time = self._channels[sent.topic], sent.log_time_ns
        payload = encoded(sent.message)
        self._writer.add_message(channel, time, payload, publish_time=time, sequence=count)

    def _register(self, sent: Sent) -> int:
        name = _SCHEMA_OF[type(sent.message)]
        if name not in self._schemas:
            module = import_module(SCHEMAS[name.replace("/msg/", "/")].module)
            text = module.DEFINITION + _TIME
            self._schemas[name] = self._writer.register_schema(name, "ros2msg", text.encode())
        durability = _TRANSIENT_LOCAL if sent.topic == STATIC_TOPIC else _VOLATILE
        quality = {"offered_qos_profiles": _QUALITY.format(durability=durability)}
        return self._writer.register_channel(sent.topic, "cdr", self._schemas[name], quality)
