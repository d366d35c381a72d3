"""Every reader of foreign bytes as a function of bytes, which raises HandeyeError or nothing."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from recording import surgery

from handeye_cli import images, recording
from handeye_cli.conventions import Setup
from handeye_cli.documents import imports, text
from handeye_cli.documents.imports import ImportOptions
from handeye_cli.recording import bag_folder, urdf

CORPUS = Path(__file__).with_name("corpus")
OPTIONS = recording.McapOptions(setup=Setup.EYE_IN_HAND)
IMPORT = ImportOptions(setup=Setup.EYE_IN_HAND, own_camera=True)
TYPES = (
    "tf2_msgs/msg/TFMessage",
    "geometry_msgs/msg/PoseStamped",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/JointState",
    "nav_msgs/msg/Odometry",
)


@cache
def folder():
    """Return a folder that lasts as long as the process."""
    holder = tempfile.TemporaryDirectory()
    folder.holder = holder
    return Path(holder.name)


def saved(name, data):
    path = folder() / name
    path.write_bytes(data)
    return path


def mcap(data):
    recording.read(str(saved("some.mcap", data)), OPTIONS)


def payloads(data):
    """Read the bytes as messages of every type, their times a second apart."""
    declared = b"".join(
        surgery.schema(index, name) + surgery.channel(index, index, f"/topic{index}")
        for index, name in enumerate(TYPES, start=1)
    )
    sent = b"".join(
        surgery.message(index, data, time * 10**9)
        for time in range(3)
        for index in range(1, len(TYPES) + 1)
    )
    recording.look(str(saved("payloads.mcap", surgery.ended(declared + sent))), OPTIONS, {})


def yaml(data):
    text.parse(data, "some.yaml")


def image(data):
    images.decode_grey(data, "some image")


def metadata(data):
    saved("some.mcap", b"")
    saved("metadata.yaml", data)
    bag_folder.files_of(str(folder()))


def description(data):
    urdf.parse(data.decode("utf-8", errors="replace"), "some.urdf")


def samples(data):
    imports.read(str(saved("some.samples", data)), IMPORT)


def table(data):
    imports.read(str(saved("some.csv", data)), IMPORT)


READERS = {
    each.__name__: each
    for each in (mcap, payloads, yaml, image, metadata, description, samples, table)
}
"""By their names, which the folders of the corpus have too."""
