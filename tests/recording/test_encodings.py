"""The encodings of payloads: what each of them has of its own, and whole recordings in each."""

import json
import struct
from functools import partial

import cv2
import numpy as np
import pytest
import zstandard
from mcap.records import Schema
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from recording import foxglove, ros2
from recording.bags import Robot, ns, pose_numbers

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.recording import McapOptions, decoding, json_text, layout
from handeye_cli.recording.container import Channel
from handeye_cli.recording.decoding import decoder_for

POSE = "geometry_msgs/PoseStamped"


def decoder(name, encoding):
    return decoder_for(Channel("/topic", encoding, name, "", b""))


def decoded(name, encoding, payload):
    return decoder(name, encoding).decode(payload)


# ROS


@pytest.mark.parametrize("little", [True, False])
def test_cdr_has_either_byte_order(little):
    pixels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    payload = ros2.image(ns(1), "camera", pixels, little=little)
    message = decoded("sensor_msgs/Image", "cdr", payload)
    assert (message.header.stamp_ns, message.header.frame_id) == (ns(1), "camera")
    assert (message.height, message.width, message.data) == (2, 3, pixels.tobytes())


@pytest.mark.parametrize("identifier", [b"\x00\x07", b"\x00\x11"])
@pytest.mark.parametrize("frame", ["b", "base", "seven_b"])
def test_cdr_of_the_second_version_aligns_to_four_bytes(identifier, frame):
    name = frame.encode() + b"\0"
    name += bytes(-len(name) % 4)
    body = struct.pack("<iII", 12, 345, len(frame) + 1) + name + struct.pack("<7d", *range(7))
    message = decoded(POSE, "cdr", identifier + b"\0\0" + body)
    assert (message.translation, message.rotation) == ((0, 1, 2), (3, 4, 5, 6))


def test_cdr_of_another_kind_is_named():
    payload = b"\x00\x03" + ros2.SAMPLES[POSE][2:]
    with pytest.raises(InputError, match="0x0003"):
        decoded(POSE, "cdr", payload)


def test_text_without_its_zero_is_no_message_of_ros2():
    payload = ros2.SAMPLES[POSE].replace(b"base\0", b"base!")
    with pytest.raises(InputError, match="b'base!' that does not end with a zero"):
        decoded(POSE, "cdr", payload)


def test_names_are_utf8():
    assert decoded(POSE, "cdr", ros2.pose(1, "größe", range(7))).header.frame_id == "größe"
    with pytest.raises(InputError, match="utf-8"):
        decoded(POSE, "cdr", ros2.SAMPLES[POSE].replace(b"base", b"\xff\xfe\xfd\xfc"))


@pytest.mark.parametrize(("encoding", "to"), [("cdr", ros2.Cdr), ("ros1", ros2.Ros1)])
def test_sequence_that_cannot_fit_is_refused_before_it_is_read(encoding, to):
    for count in (2**32 - 1, 10**6):
        with pytest.raises(InputError, match=f"a length of {count}, 0 bytes before its end"):
            decoded("tf2_msgs/TFMessage", encoding, to().put("I", count).done())
    many = to().put("I", 10**6).done() + bytes(10**6)
    with pytest.raises(InputError, match="1000000 parts, of which at most 100000"):
        decoded("tf2_msgs/TFMessage", encoding, many)


def test_time_of_ros1_has_no_sign():
    payload = ros2.pose(3_000_000_000 * 10**9, "base", range(7), to=ros2.Ros1)
    assert decoded(POSE, "ros1", payload).header.stamp_ns == 3_000_000_000 * 10**9


def test_uppercase_matrices_of_ros1_are_the_same_bytes():
    info = decoded("sensor_msgs/CameraInfo", "ros1", ros2.ROS1_SAMPLES["sensor_msgs/CameraInfo"])
    assert info.k == tuple(range(1, 10))


# messages packed one by one


def packed(payload, **options):
    return zstandard.ZstdCompressor(**options).compress(payload)


@pytest.mark.parametrize("sized", [True, False])
def test_message_packed_by_itself_is_unpacked(sized):
    name = "sensor_msgs/CompressedImage"
    payload = packed(ros2.SAMPLES[name], write_content_size=sized)
    assert decoded(name, "cdr", payload) == decoded(name, "cdr", ros2.SAMPLES[name])
    assert decoder(name, "cdr").header(payload).frame_id == "camera"


@pytest.mark.parametrize("sized", [True, False])
def test_packed_message_that_would_fill_the_memory_is_refused(monkeypatch, sized):
    monkeypatch.setattr(decoding, "MAX_MESSAGE_BYTES", 10_000)
    payload = packed(ros2.SAMPLES[POSE] + bytes(10**7), write_content_size=sized)
    with pytest.raises(InputError, match="more than 10000 bytes"):
        decoded(POSE, "cdr", payload)


def test_packed_message_that_says_it_is_too_large_is_not_unpacked(monkeypatch):
    monkeypatch.setattr(decoding, "MAX_MESSAGE_BYTES", 10_000)
    monkeypatch.setattr(decoding.zstandard, "ZstdDecompressor", None)
    with pytest.raises(InputError, match="more than 10000 bytes"):
        decoded(POSE, "cdr", packed(bytes(10_001)))


def test_packed_message_that_lies_about_its_size_is_refused():
    payload = bytearray(packed(bytes(100)))
    assert payload[5] == 100  # after the magic and the frame's descriptor
    payload[5] = 101
    with pytest.raises(InputError, match="found damage"):
        decoded(POSE, "cdr", bytes(payload))
    for length in range(4, len(payload)):
        with pytest.raises(InputError, match="found damage"):
            decoded(POSE, "cdr", packed(ros2.SAMPLES[POSE])[:length])


# protobuf

RAW, TRANSFORM, INFO = "foxglove.RawImage", "foxglove.FrameTransform", "foxglove.CameraCalibration"


def test_field_that_is_missing_has_its_default():
    image = decoded(RAW, "protobuf", b"")
    assert (image.header.stamp_ns, image.width, image.encoding, image.data) == (0, 0, "", b"")
    (transform,) = decoded(TRANSFORM, "protobuf", b"").transforms
    assert (transform.translation, transform.rotation) == ((0, 0, 0), (0, 0, 0, 0))
    assert decoded(INFO, "protobuf", b"").k == (0.0,) * 9
    assert decoded("foxglove.FrameTransforms", "protobuf", b"").transforms == ()


def test_default_that_is_left_out_is_zero():
    values = foxglove.frame_transform(ns(1), "a", "b", (1, 0, 0, 0, 0, 0, 1))
    payload = foxglove.as_protobuf("foxglove.FrameTransform", values)
    assert len(payload) < 60
    (transform,) = decoded(TRANSFORM, "protobuf", payload).transforms
    assert transform.translation == (1, 0, 0)
    assert transform.rotation == (0, 0, 0, 1)


@pytest.mark.parametrize("stamp", [0, 1, -1, -(10**9), 10**18])
def test_times_before_and_after_the_epoch(stamp):
    payload = foxglove.as_protobuf(RAW, {"timestamp": stamp})
    assert decoded(RAW, "protobuf", payload).header.stamp_ns == stamp


def test_time_that_fits_no_clock_is_refused():
    message = foxglove.message_class(RAW)()
    message.timestamp.seconds = 2**62
    with pytest.raises(InputError, match=f"a time of {2**62} s"):
        decoded(RAW, "protobuf", message.SerializeToString())


def test_fields_come_in_any_order_and_unknown_ones_are_passed_over():
    values = {"timestamp": ns(2), "frame_id": "c", "width": 7}
    fields = [foxglove.as_protobuf(RAW, {key: value}) for key, value in values.items()]
    unknown = [
        bytes([15 << 3 | 0, 0xFF, 0x01]), bytes([15 << 3 | 1]) + bytes(8),
        bytes([15 << 3 | 2, 3]) + b"abc", bytes([15 << 3 | 5]) + bytes(4),
    ]  # fmt: skip
    payload = b"".join([unknown[0], *reversed(fields), *unknown])
    image = decoded(RAW, "protobuf", payload)
    assert (image.header.stamp_ns, image.header.frame_id, image.width) == (ns(2), "c", 7)


def test_parts_of_a_message_that_come_twice_are_joined():
    half = foxglove.as_protobuf(TRANSFORM, {"translation": {"x": 1.0}})
    other = foxglove.as_protobuf(TRANSFORM, {"translation": {"y": 2.0}, "child_frame_id": "b"})
    google = foxglove.message_class(TRANSFORM).FromString(half + other)
    (transform,) = decoded(TRANSFORM, "protobuf", half + other).transforms
    assert (google.translation.x, google.translation.y) == transform.translation[:2] == (1, 2)


def test_numbers_come_packed_or_one_by_one():
    one_by_one = b"".join(bytes([5 << 3 | 1]) + struct.pack("<d", x) for x in (0.5, 0.25))
    assert foxglove.message_class(INFO).FromString(one_by_one).D == [0.5, 0.25]
    assert decoded(INFO, "protobuf", one_by_one).d == (0.5, 0.25)


def field(number, wire, rest):
    return bytes([number << 3 | wire]) + rest


@pytest.mark.parametrize(
    ("name", "payload", "found"),
    [
        (RAW, field(2, 0, b"\x05"), "wire type 0 of 'width', which has 5"),
        (RAW, field(4, 5, bytes(4)), "wire type 5 of 'encoding', which has 2"),
        (RAW, field(6, 3, b""), "wire type 3 of the field 6"),
        (RAW, field(6, 2, b"\xff\xff\xff\xff\x0f"), "4294967295 bytes of the field 6, 0 before"),
        (RAW, field(0, 5, bytes(4)), "a field with the number 0"),
        (RAW, field(9, 0, b"\xff" * 11), "a varint without an end"),
        (TRANSFORM, field(4, 1, bytes(8)), "wire type 1 of 'translation'"),
        (INFO, field(6, 2, b"\x09" + bytes(9)), "9 bytes of numbers of 'K'"),
        (INFO, field(6, 2, b"\x10" + bytes(16)), "2 numbers of 'K', which has 9"),
    ],
)
def test_damage_of_protobuf_is_named(name, payload, found):
    with pytest.raises(InputError, match=found) as caught:
        decoded(name, "protobuf", payload)
    assert caught.value.where == "a message of /topic"


def test_empty_transforms_cannot_fill_the_memory(monkeypatch):
    monkeypatch.setattr(layout, "MOST_PARTS", 1000)
    payload = field(1, 2, b"\0") * 1001
    with pytest.raises(InputError, match="1001 parts, of which at most 1000"):
        decoded("foxglove.FrameTransforms", "protobuf", payload)


# JSON


def test_texts_times_and_numbers_may_be_missing_in_json():
    info = decoded(INFO, "json", b'{"width": 4, "height": 3}')
    assert (info.header.stamp_ns, info.header.frame_id) == (0, "")
    assert (info.d, info.k) == ((), (0.0,) * 9)


CHANGES = [
    ("translation", None, "translation: expected an object, found nothing"),
    ("translation", {"x": 1, "y": 2}, "translation.z: expected a number, found nothing"),
    ("translation", {"x": "1", "y": 2, "z": 3}, "translation.x: expected a number, found '1'"),
    ("translation", {"x": True, "y": 2, "z": 3}, "translation.x: expected a number, found True"),
    ("translation", [1, 2, 3], r"translation: expected an object, found \[1, 2, 3\]"),
    ("child_frame_id", 7, "child_frame_id: expected a text, found 7"),
    ("child_frame_id", "\ud800", "surrogates not allowed"),
    ("timestamp", 12.5, "timestamp: expected an object with sec and nsec, found 12.5"),
    ("timestamp", {"sec": 1, "nanosec": 2}, "timestamp.nsec: .* found nothing"),
    ("timestamp", {"sec": 1, "nsec": 10**9}, "timestamp.nsec: .* to 999999999, found 10"),
    ("timestamp", {"sec": 1.5, "nsec": 0}, "timestamp.sec: expected a whole .*, found 1.5"),
    ("timestamp", {"sec": 2**62, "nsec": 0}, f"a time of {2**62} s"),
]


@pytest.mark.parametrize(("key", "value", "found"), CHANGES)
def test_wrong_values_of_json_are_named_by_their_place(key, value, found):
    message = json.loads(foxglove.JSON_SAMPLES[TRANSFORM])
    with pytest.raises(InputError, match=found):
        decoded(TRANSFORM, "json", json.dumps(message | {key: value}).encode())


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "9" * 400])
def test_numbers_that_are_none_are_refused(number):
    text = foxglove.JSON_SAMPLES[TRANSFORM].replace(b'"x": 1', b'"x": ' + number.encode())
    assert number.encode() in text
    with pytest.raises(InputError, match="found damage"):
        decoded(TRANSFORM, "json", text)


@pytest.mark.parametrize(
    ("name", "key", "value", "found"),
    [
        (RAW, "data", "no base64!", "found damage"),
        (RAW, "data", [1, 2], "data: expected base64 text, found .1, 2."),
        (RAW, "width", -1, "width: expected a whole number from 0 to 4294967295, found -1"),
        (RAW, "width", 2.0, "width: .*, found 2.0"),
        (INFO, "K", [1.0] * 8, "K: expected 9 numbers, found 8"),
        (INFO, "K", [None] * 9, r"K\[0\]: expected a number, found nothing"),
        ("foxglove.FrameTransforms", "transforms", {}, "transforms: expected an array"),
        ("foxglove.FrameTransforms", "transforms", [3], r"transforms\[0\]: expected an object"),
    ],
)
def test_wrong_members_of_json_are_named(name, key, value, found):
    message = json.loads(foxglove.JSON_SAMPLES[name])
    with pytest.raises(InputError, match=found):
        decoded(name, "json", json.dumps(message | {key: value}).encode())


@pytest.mark.parametrize("payload", [b"[1]", b"7", b"null", b"", b"\xff\xfe{", b"[" * 10**5])
def test_json_that_is_no_message_is_refused(payload):
    with pytest.raises(InputError, match="found damage"):
        decoded(TRANSFORM, "json", payload)


def test_json_that_would_fill_the_memory_is_refused(monkeypatch):
    monkeypatch.setattr(json_text, "MAX_BYTES", 100)
    with pytest.raises(InputError, match="bytes, more than 100"):
        decoded(TRANSFORM, "json", foxglove.JSON_SAMPLES[TRANSFORM])


# whole recordings


def transcoder(encode):
    """Return the function that turns a message of ROS 2, read by the reference, into another."""
    decoders = {}

    def transcode(log_ns, topic, name, payload):
        if name not in decoders:
            text = ros2.TEXTS[name.replace("/msg/", "/")].encode()
            schema = Schema(id=1, name=name, encoding="ros2msg", data=text)
            decoders[name] = DecoderFactory().decoder_for("cdr", schema)
        schema, data = encode[name.rsplit("/", 1)[-1]](decoders[name](payload))
        return log_ns, topic, schema, data

    return transcode


def head(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec, header.frame_id


def links(message):
    for each in message.transforms:
        t, q = each.transform.translation, each.transform.rotation
        stamp, parent = head(each.header)
        yield stamp, parent, each.child_frame_id, (t.x, t.y, t.z, q.x, q.y, q.z, q.w)


def pixels(message):
    shape = message.height, message.width
    return np.frombuffer(bytes(message.data), dtype=np.uint8).reshape(shape)


def of_camera(info):
    return {
        "k": list(info.k), "d": list(info.d), "model": info.distortion_model, "p": list(info.p),
        "size": (info.width, info.height),
    }  # fmt: skip


def raw(image):
    return {"data": bytes(image.data), "encoding": image.encoding, "step": image.step}


ROS1 = {
    "TFMessage": lambda m: ("tf2_msgs/TFMessage", ros2.transforms(*links(m), to=ros2.Ros1)),
    "Image": lambda m: (
        "sensor_msgs/Image", ros2.image(*head(m.header), pixels(m), to=ros2.Ros1),
    ),
    "CameraInfo": lambda m: (
        "sensor_msgs/CameraInfo", ros2.camera_info(*head(m.header), **of_camera(m), to=ros2.Ros1),
    ),
}  # fmt: skip
OLD_ROS1 = ROS1 | {
    "TFMessage": lambda m: ("tf/tfMessage", ros2.transforms(*links(m), to=ros2.Ros1)),
}
FOXGLOVE_ROS2 = {
    "TFMessage": lambda m: ("foxglove_msgs/msg/FrameTransforms", ros2.frame_transforms(*links(m))),
    "Image": lambda m: (
        "foxglove_msgs/msg/RawImage",
        ros2.raw_image(*head(m.header), (m.width, m.height), **raw(m)),
    ),
    "CameraInfo": lambda m: (
        "foxglove_msgs/msg/CameraCalibration",
        ros2.camera_calibration(*head(m.header), **of_camera(m)),
    ),
}


def foxglove_encoded(serialise, *, compressed):
    def transforms(message):
        values = {"transforms": [foxglove.frame_transform(*each) for each in links(message)]}
        return serialise("foxglove.FrameTransforms", values)

    def image(message):
        if not compressed:
            size = message.width, message.height
            values = foxglove.raw_image(*head(message.header), size, **raw(message))
            return serialise("foxglove.RawImage", values)
        png = cv2.imencode(".png", pixels(message))[1].tobytes()
        values = foxglove.compressed_image(*head(message.header), png, "png")
        return serialise("foxglove.CompressedImage", values)

    def info(message):
        values = foxglove.camera_calibration(*head(message.header), **of_camera(message))
        return serialise("foxglove.CameraCalibration", values)

    return {"TFMessage": transforms, "Image": image, "CameraInfo": info}


def protobuf(name, values):
    return name, foxglove.as_protobuf(name, values)


def in_json(name, values):
    return name, foxglove.as_json(values)


ROS2 = "ros2", "cdr", "ros2msg", b""
PROTOBUF = "", "protobuf", "protobuf", foxglove.descriptor()
JSON = "", "json", "jsonschema", b"{}"
FORMS = {
    "ros1": (("ros1", "ros1", "ros1msg", b""), ROS1),
    "old-ros1": (("ros1", "ros1", "ros1msg", b""), OLD_ROS1),
    "foxglove-ros2": (ROS2, FOXGLOVE_ROS2),
    "protobuf": (PROTOBUF, foxglove_encoded(protobuf, compressed=False)),
    "protobuf-png": (PROTOBUF, foxglove_encoded(protobuf, compressed=True)),
    "json": (JSON, foxglove_encoded(in_json, compressed=False)),
    "json-png": (JSON, foxglove_encoded(in_json, compressed=True)),
}
"""(Profile, message encoding, schema encoding, schema data) and how messages are written."""


def write(path, messages, form):
    """Write (log time, topic, schema name, payload), all in one encoding."""
    profile, encoding, schema_encoding, schema_data = form
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile, library="test")
        channels = {}
        for log_ns, topic, schema, payload in messages:
            if topic not in channels:
                schema_id = writer.register_schema(schema, schema_encoding, schema_data)
                channels[topic] = writer.register_channel(topic, encoding, schema_id)
            writer.add_message(channels[topic], log_ns, payload, log_ns)
        writer.finish()
    return str(path)


OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)


@pytest.fixture(scope="module")
def messages():
    return Robot(stations=3, rate=50.0).messages()


@pytest.fixture(scope="module")
def wanted(messages, tmp_path_factory):
    path = tmp_path_factory.mktemp("ros2") / "robot.mcap"
    return recording.read(write(path, messages, ROS2), OPTIONS)


@pytest.mark.parametrize(("form", "encode"), FORMS.values(), ids=FORMS)
def test_recording_gives_the_same_stations_in_every_encoding(
    tmp_path, messages, wanted, form, encode
):
    transcode = transcoder(encode)
    other = [transcode(*message) for message in messages]
    found = recording.read(write(tmp_path / "robot.mcap", other, form), OPTIONS)
    assert found.camera == wanted.camera
    assert found.findings == wanted.findings
    assert [station.name for station in found.stations] == ["00", "01", "02"]
    for one, same in zip(found.stations, wanted.stations, strict=True):
        np.testing.assert_array_equal(one.base_T_gripper, same.base_T_gripper)
        np.testing.assert_array_equal(one.image.load(), same.image.load())


def test_messages_packed_one_by_one_give_the_same_stations(tmp_path, messages, wanted):
    other = [(*message[:3], packed(message[3])) for message in messages]
    path = write(tmp_path / "robot.mcap", other, ROS2)
    found = recording.read(path, OPTIONS)
    assert len(found.stations) == 3
    for one, same in zip(found.stations, wanted.stations, strict=True):
        np.testing.assert_array_equal(one.base_T_gripper, same.base_T_gripper)
        np.testing.assert_array_equal(one.image.load(), same.image.load())


POSES = {
    "PoseStamped": ("geometry_msgs/msg/PoseStamped", "cdr", ros2.pose),
    "PoseWithCovarianceStamped": (
        "geometry_msgs/PoseWithCovarianceStamped",
        "ros1",
        partial(ros2.pose_with_covariance, to=ros2.Ros1),
    ),
    "Odometry": (
        "nav_msgs/msg/Odometry",
        "cdr",
        lambda stamp, frame, numbers: ros2.odometry(stamp, frame, "flange", numbers),
    ),
    "PoseInFrame": (
        "foxglove.PoseInFrame",
        "protobuf",
        lambda *pose: foxglove.as_protobuf("foxglove.PoseInFrame", foxglove.pose_in_frame(*pose)),
    ),
    "PoseInFrame in JSON": (
        "foxglove.PoseInFrame",
        "json",
        lambda *pose: foxglove.as_json(foxglove.pose_in_frame(*pose)),
    ),
}


@pytest.mark.parametrize("kind", POSES)
def test_poses_of_the_gripper_in_every_kind_of_message(tmp_path, kind):
    """Poses and images are written in different encodings, into one file."""
    robot = Robot(stations=3, noise=0.0)
    schema, encoding, encode = POSES[kind]
    poses = [
        (ns(t), "/tcp", schema, encode(ns(t), "base", pose_numbers(robot.noisy(robot.upper, t))))
        for t in np.arange(0.0, robot.duration, 0.02).tolist()
    ]
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        tcp = writer.register_channel("/tcp", encoding, writer.register_schema(schema, "", b""))
        name = "sensor_msgs/msg/Image"
        images = writer.register_channel("/image", "cdr", writer.register_schema(name, "", b""))
        for channel, sent in ((tcp, poses), (images, robot.images())):
            for log_ns, _, _, payload in sent:
                writer.add_message(channel, log_ns, payload, log_ns)
        writer.finish()
    found = recording.read(str(path), OPTIONS)
    poses_found = np.stack([station.base_T_gripper for station in found.stations])
    np.testing.assert_allclose(poses_found, robot.upper, atol=1e-5)
    gripper = "flange" if kind == "Odometry" else "/tcp"
    choices = next(each for each in found.findings if each.code == "recording-choices")
    assert f"base 'base', gripper '{gripper}'" in choices.message
