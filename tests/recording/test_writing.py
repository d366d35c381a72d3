"""MCAP files that we write, as others read them: the official reader, and CDR taken apart here."""

import io
import struct
import tracemalloc

import cv2
import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from recording import ros2

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3
from handeye_cli.images import decode_grey, encode_png
from handeye_cli.recording import McapOptions, read
from handeye_cli.recording.cdr_writing import encoded
from handeye_cli.recording.messages import (
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    TransformsMessage,
    TransformStamped,
)
from handeye_cli.recording.transforms import Samples
from handeye_cli.recording.writing import IMAGE_DELAY_NS, Streams, write
from handeye_cli.records import Camera

START = 1_700_000_000_000_000_000
CAMERA = Camera(64, 48, 600.0, 610.0, 31.5, 23.25, (0.1, -0.2, 1e-3, -2e-3, 0.05))
HEADER = Header(12_000_000_345, "camera")


def picture(k):
    return np.random.default_rng(k).integers(0, 256, (48, 64), dtype=np.uint8)


def pictures(count=6, period=100_000_000):
    for k in range(count):
        yield START + k * period, picture(k)


def link(parent, child, count, *, static=False, seed=1):
    rng = np.random.default_rng(seed)
    stamps = START + np.arange(count) * 10_000_000
    q = rotations.quaternion_from_matrix(rotations.exp(rng.normal(size=(count, 3))))
    numbers = np.concatenate([rng.normal(size=(count, 3)), q], axis=1)
    return Samples(parent, child, static, stamps, stamps + 2_000_000, numbers)


def streams(**changed):
    links = (link("world", "base_link", 1, static=True), link("base_link", "tool0", 60, seed=2))
    return Streams(**{"camera": CAMERA, "pictures": pictures(), "links": links, **changed})


def written(**changed):
    file = io.BytesIO()
    write(file, streams(**changed))
    return file.getvalue()


class CdrReader:
    """Takes little-endian CDR apart: alignment counts from the end of the four leading bytes."""

    def __init__(self, data):
        assert data[:4] == b"\x00\x01\x00\x00"
        self.data, self.at = data[4:], 0

    def take(self, code, count=1):
        size = struct.calcsize(code)
        self.at += -self.at % size
        values = struct.unpack_from(f"<{count}{code}", self.data, self.at)
        self.at += size * count
        return values if count > 1 else values[0]

    def octets(self):
        count = self.take("I")
        self.at += count
        return self.data[self.at - count : self.at]

    def text(self):
        raw = self.octets()
        assert raw[-1:] == b"\0"
        return raw[:-1].decode()

    def header(self):
        return self.take("i") * 10**9 + self.take("I"), self.text()

    def done(self):
        assert self.at == len(self.data)


def messages(data):
    return list(make_reader(io.BytesIO(data), validate_crcs=True).iter_messages())


def on(data, topic):
    return [
        (message, schema) for schema, channel, message in messages(data) if channel.topic == topic
    ]


EARLY, LATE = Header(12_000_000_345, "base"), Header(13_000_000_000, "tool")
SENT = {
    "sensor_msgs/Image": ImageMessage(HEADER, 1, 2, "mono8", True, 3, b"\x07\x08\x09"),
    "sensor_msgs/CompressedImage": CompressedImageMessage(HEADER, "jpeg", b"\xff\xd8"),
    "sensor_msgs/CameraInfo": CameraInfoMessage(
        HEADER, 640, 480, "plumb_bob", (0.1, 0.2), k=tuple(range(1, 10)), p=tuple(range(12)),
        binning_x=2, binning_y=3, roi=(4, 5, 60, 70),
    ),
    "tf2_msgs/TFMessage": TransformsMessage((
        TransformStamped(EARLY, "tool", (1, 2, 3), (0.5, -0.5, 0.5, 0.5)),
        TransformStamped(LATE, "camera", (4, 5, 6), (0, 0, 0, 1)),
    )),
}  # fmt: skip


@pytest.mark.parametrize("schema", SENT)
def test_payloads_are_the_bytes_written_by_hand(schema):
    assert encoded(SENT[schema]) == ros2.SAMPLES[schema]


def test_a_raw_picture_is_read_by_the_official_reader_and_plain_struct():
    found = on(written(compressed=False), "/camera/image_raw")
    assert len(found) == 6
    for k, (message, schema) in enumerate(found):
        assert (schema.name, schema.encoding) == ("sensor_msgs/msg/Image", "ros2msg")
        assert message.log_time == message.publish_time
        assert message.log_time == START + k * 100_000_000 + IMAGE_DELAY_NS
        assert message.sequence == k
        reader = CdrReader(message.data)
        assert reader.header() == (START + k * 100_000_000, "camera_optical_frame")
        assert (reader.take("I", 2), reader.text()) == ((48, 64), "mono8")
        assert (reader.take("B"), reader.take("I")) == (0, 64)
        assert reader.octets() == picture(k).tobytes()
        reader.done()


def test_a_compressed_picture_is_a_png_of_the_same_pixels():
    found = on(written(), "/camera/image_raw/compressed")
    assert len(found) == 6
    for k, (message, schema) in enumerate(found):
        assert schema.name == "sensor_msgs/msg/CompressedImage"
        reader = CdrReader(message.data)
        assert reader.header() == (START + k * 100_000_000, "camera_optical_frame")
        assert "png" in reader.text()
        data = np.frombuffer(reader.octets(), dtype=np.uint8)
        assert np.array_equal(cv2.imdecode(data, cv2.IMREAD_UNCHANGED), picture(k))
        reader.done()


def test_a_png_keeps_every_grey_level_and_needs_pixels():
    ramp = np.arange(256, dtype=np.uint8).reshape(8, 32)
    assert np.array_equal(decode_grey(encode_png(ramp), "ramp"), ramp)
    with pytest.raises(InputError, match="found 5 x 0"):
        encode_png(np.zeros((0, 5), dtype=np.uint8))


def test_every_picture_has_its_intrinsics():
    found = on(written(), "/camera/camera_info")
    assert len(found) == 6
    for k, (message, _) in enumerate(found):
        reader = CdrReader(message.data)
        assert reader.header() == (START + k * 100_000_000, "camera_optical_frame")
        assert (reader.take("I", 2), reader.text()) == ((48, 64), "plumb_bob")
        assert reader.take("d", reader.take("I")) == CAMERA.distortion
        assert reader.take("d", 9) == (600.0, 0.0, 31.5, 0.0, 610.0, 23.25, 0.0, 0.0, 1.0)
        assert reader.take("d", 9) == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        assert reader.take("d", 12) == (
            600.0, 0.0, 31.5, 0.0, 0.0, 610.0, 23.25, 0.0, 0.0, 0.0, 1.0, 0.0,
        )  # fmt: skip
        assert reader.take("I", 6) == (0,) * 6
        assert reader.take("B") == 0
        reader.done()


@pytest.mark.parametrize(("topic", "index"), [("/tf_static", 0), ("/tf", 1)])
def test_transforms_keep_every_digit(topic, index):
    sent = streams().links[index]
    found = on(written(), topic)
    assert len(found) == len(sent.stamps_ns)
    for k, (message, schema) in enumerate(found):
        assert schema.name == "tf2_msgs/msg/TFMessage"
        assert message.log_time == sent.log_times_ns[k]
        reader = CdrReader(message.data)
        assert reader.take("I") == 1
        assert reader.header() == (sent.stamps_ns[k], sent.parent)
        assert reader.text() == sent.child
        assert reader.take("d", 7) == tuple(sent.numbers[k])
        reader.done()


def test_messages_lie_in_the_file_in_order_of_their_times():
    records = StreamReader(io.BytesIO(written())).records
    times = [record.log_time for record in records if isinstance(record, Message)]
    assert len(times) == 1 + 60 + 6 + 6
    assert times == sorted(times)


def test_texts_of_the_schemas_are_enough_for_a_decoder_that_knows_nothing():
    factory = DecoderFactory()
    for schema, channel, message in messages(written()):
        assert channel.message_encoding == "cdr"
        assert b"MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" in schema.data
        decoded = factory.decoder_for("cdr", schema)(message.data)
        header = getattr(decoded, "header", None) or decoded.transforms[0].header
        assert START <= header.stamp.sec * 10**9 + header.stamp.nanosec <= message.log_time


def test_ros_is_told_to_keep_static_transforms():
    summary = make_reader(io.BytesIO(written())).get_summary()
    durability = {}
    for channel in summary.channels.values():
        (quality,) = yaml.safe_load(channel.metadata["offered_qos_profiles"])
        assert {"history", "depth", "reliability", "deadline", "lifespan", "liveliness"} < set(
            quality
        )
        durability[channel.topic] = quality["durability"]
    transient_local, volatile = 1, 2
    assert durability.pop("/tf_static") == transient_local
    assert set(durability.values()) == {volatile}


def test_header_and_notes_say_who_wrote_the_file():
    data = written(notes={"seed": "7"})
    reader = make_reader(io.BytesIO(data))
    assert reader.get_header().profile == "ros2"
    assert reader.get_header().library.startswith("handeye ")
    assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [("handeye", {"seed": "7"})]
    assert list(make_reader(io.BytesIO(written())).iter_metadata()) == []


def test_the_same_streams_give_the_same_bytes():
    assert written() == written()
    assert written() != written(pictures=pictures(5))


def peak_of(count, path):
    """The most bytes in use while so many pictures of 300 kB are written."""
    noise = np.random.default_rng(1).integers(0, 256, (480, 640), dtype=np.uint8)
    many = ((START + k * 100_000_000, noise + np.uint8(k)) for k in range(count))
    tracemalloc.start()
    with path.open("wb") as file:
        write(file, streams(pictures=many, compressed=False))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def test_memory_does_not_grow_with_the_recording(tmp_path):
    few, many = (peak_of(count, tmp_path / "robot.mcap") for count in (20, 60))
    assert many < 1.1 * few
    assert many < 6_000_000 < 60 * 300_000


def test_our_own_reader_finds_the_camera_and_the_chain(tmp_path):
    """A robot that rests for a second, moves for one and rests again."""
    stamps = START + np.arange(300) * 10_000_000
    share = np.clip((np.arange(300) - 100) / 100, 0.0, 1.0)
    turn = 0.5 * share**2 * (3 - 2 * share)
    poses = se3.from_parts(
        rotations.exp(turn[:, None] * np.array([0.0, 0.0, 1.0])), 0.2 * turn[:, None] * np.ones(3)
    )
    q = rotations.quaternion_from_matrix(poses[:, :3, :3])
    numbers = np.concatenate([poses[:, :3, 3], q], axis=1)
    moving = Samples("base_link", "tool0", False, stamps, stamps + 2_000_000, numbers)
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        write(file, streams(links=(moving,), pictures=pictures(29)))
    recording = read(str(path), McapOptions(setup=Setup.EYE_IN_HAND))
    assert recording.camera == CAMERA
    assert len(recording.stations) == 2
    for station, pose in zip(recording.stations, poses[[0, -1]], strict=True):
        assert station.base_T_gripper == pytest.approx(pose, abs=1e-4)
        assert station.image.load().shape == (48, 64)
