"""What every registered message schema must do in every encoding it is read in."""

import contextlib
from importlib import import_module

import numpy as np
import pytest
from google.protobuf.message import DecodeError
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from recording import foxglove, ros2

from handeye_cli.errors import InputError
from handeye_cli.recording import messages
from handeye_cli.recording.container import Channel
from handeye_cli.recording.decoding import decoder_for
from handeye_cli.recording.message_table import ENCODINGS, REFUSED, SCHEMAS, plain_name
from handeye_cli.recording.messages import Header, Role

KINDS = {
    Role.IMAGE: messages.AnyImage,
    Role.CAMERA_INFO: messages.CameraInfoMessage,
    Role.TRANSFORMS: messages.TransformsMessage,
    Role.POSE: messages.PoseStamped,
    Role.JOINTS: messages.JointsMessage,
    Role.TEXT: messages.TextMessage,
}
STAMP = Header(12_000_000_345, "camera")
IN_BASE = Header(12_000_000_345, "base")
TOOL = messages.TransformStamped(IN_BASE, "tool", (1, 2, 3), (0.5, -0.5, 0.5, 0.5))
CAMERA = messages.TransformStamped(
    Header(13_000_000_000, "tool"), "camera", (4, 5, 6), (0, 0, 0, 1)
)
POSE = messages.PoseStamped(IN_BASE, (1, 2, 3), (0.5, -0.5, 0.5, 0.5))
K_AND_P = tuple(range(1, 10)), tuple(range(12))
EXPECTED = {
    "sensor_msgs/Image": messages.ImageMessage(STAMP, 1, 2, "mono8", True, 3, b"\x07\x08\x09"),
    "sensor_msgs/CompressedImage": messages.CompressedImageMessage(STAMP, "jpeg", b"\xff\xd8"),
    "sensor_msgs/CameraInfo": messages.CameraInfoMessage(
        STAMP, 640, 480, "plumb_bob", (0.1, 0.2), *K_AND_P, 2, 3, (4, 5, 60, 70)
    ),
    "tf2_msgs/TFMessage": messages.TransformsMessage((TOOL, CAMERA)),
    "tf/tfMessage": messages.TransformsMessage((TOOL, CAMERA)),
    "geometry_msgs/TransformStamped": messages.TransformsMessage((TOOL,)),
    "geometry_msgs/PoseStamped": POSE,
    "geometry_msgs/PoseWithCovarianceStamped": POSE,
    "nav_msgs/Odometry": messages.PoseStamped(IN_BASE, POSE.translation, POSE.rotation, "tool"),
    "sensor_msgs/JointState": messages.JointsMessage(
        Header(12_000_000_345, ""), (("a", 0.5), ("elbow", -1.25))
    ),
    "std_msgs/String": messages.TextMessage("<robot/>"),
    "foxglove.RawImage": messages.ImageMessage(STAMP, 1, 2, "mono8", False, 3, b"\x07\x08\x09"),
    "foxglove.CompressedImage": messages.CompressedImageMessage(STAMP, "jpeg", b"\xff\xd8"),
    "foxglove.CameraCalibration": messages.CameraInfoMessage(
        STAMP, 640, 480, "plumb_bob", (0.1, 0.2), *K_AND_P, 0, 0, (0, 0, 0, 0)
    ),
    "foxglove.FrameTransform": messages.TransformsMessage((TOOL,), lasting=True),
    "foxglove.FrameTransforms": messages.TransformsMessage((TOOL, CAMERA), lasting=True),
    "foxglove.PoseInFrame": POSE,
}
SAMPLES = {
    "cdr": ros2.SAMPLES,
    "ros1": ros2.ROS1_SAMPLES,
    "protobuf": foxglove.PROTOBUF_SAMPLES,
    "json": foxglove.JSON_SAMPLES,
}
PAIRS = [(name, encoding) for name, row in SCHEMAS.items() for encoding in row.encodings]
IMAGES = [(name, encoding) for name, encoding in PAIRS if SCHEMAS[name].role is Role.IMAGE]


def decoder_of(name, encoding="cdr", schema=("ros2msg", b"")):
    return decoder_for(Channel("/topic", encoding, name, *schema))


def spellings(name, encoding):
    if name.startswith("foxglove.") and encoding in {"cdr", "ros1"}:
        package, _, message = name.partition(".")
        return [f"{package}_msgs/{message}", f"{package}_msgs/msg/{message}"]
    return [name, name.replace("/", "/msg/")]


@pytest.mark.parametrize(("name", "encoding"), PAIRS)
def test_gives_every_field_with_either_spelling_of_the_name(name, encoding):
    for spelling in spellings(name, encoding):
        decoder = decoder_of(spelling, encoding)
        message = decoder.decode(SAMPLES[encoding][name])
        assert message == EXPECTED[name]
        assert isinstance(message, KINDS[decoder.role])
        assert hash(message) == hash(EXPECTED[name])


def stamped_in_cdr():
    return [name for name, encoding in PAIRS if encoding == "cdr" and name != "std_msgs/String"]


@pytest.mark.parametrize("name", stamped_in_cdr())
def test_sample_is_what_the_reference_decoder_reads(name):
    text = ros2.TEXTS[name].encode()
    schema = Schema(id=1, name=spellings(name, "cdr")[-1], encoding="ros2msg", data=text)
    reference = DecoderFactory().decoder_for("cdr", schema)(ros2.SAMPLES[name])
    ours = EXPECTED[name]
    if isinstance(ours, messages.TransformsMessage):
        reference = reference.transforms[0] if hasattr(reference, "transforms") else reference
        ours = ours.transforms[0]
        assert reference.child_frame_id == ours.child_frame_id
        numbers = getattr(reference, "transform", reference)
        assert (numbers.translation.z, numbers.rotation.y) == (3, -0.5)
    header = getattr(reference, "header", reference)
    stamp = getattr(header, "stamp", None) or header.timestamp
    frame = header.frame_id if hasattr(header, "frame_id") else header.parent_frame_id
    assert (stamp.sec * 10**9 + stamp.nanosec, frame) == (
        ours.header.stamp_ns,
        ours.header.frame_id,
    )


@pytest.mark.parametrize(("name", "encoding"), IMAGES)
def test_header_of_an_image_is_read_without_its_pixels(name, encoding):
    decoder = decoder_of(name, encoding)
    assert decoder.header(SAMPLES[encoding][name]) == STAMP


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
@pytest.mark.parametrize("name", sorted({name for name, _ in IMAGES}))
def test_header_is_read_from_the_first_bytes_alone(name, encoding):
    sample = SAMPLES[encoding][name]
    end = sample.index(b"camera") + len("camera\0" if encoding == "cdr" else "camera")
    assert decoder_of(name, encoding).header(sample[:end]) == STAMP
    with pytest.raises(InputError):
        decoder_of(name, encoding).header(sample[: end - 1])


@pytest.mark.parametrize(("name", "encoding"), [pair for pair in PAIRS if pair[1] != "protobuf"])
def test_shortened_message_is_refused_wherever_it_ends(name, encoding):
    decoder, sample = decoder_of(name, encoding), SAMPLES[encoding][name]
    for length in range(len(sample)):
        with pytest.raises(InputError, match=f"intact {name} in {encoding}, found") as caught:
            decoder.decode(sample[:length])
        assert caught.value.where == "a message of /topic"


@pytest.mark.parametrize("name", foxglove.VALUES)
def test_shortened_protobuf_is_refused_where_google_refuses_it(name):
    """It may end after any field: what would follow is not there, or has its default."""
    decoder, sample = decoder_of(name, "protobuf"), foxglove.PROTOBUF_SAMPLES[name]
    refused = 0
    for length in range(len(sample)):
        try:
            reference = foxglove.message_class(name).FromString(sample[:length])
        except DecodeError:
            refused += 1
            with pytest.raises(InputError, match=f"intact {name} in protobuf, found"):
                decoder.decode(sample[:length])
        else:
            message = decoder.decode(sample[:length])
            if hasattr(reference, "frame_id"):
                assert message.header.frame_id == reference.frame_id
    assert refused > 0.8 * len(sample)


@pytest.mark.parametrize(("name", "encoding"), PAIRS)
def test_changed_bytes_give_a_message_or_the_fault(name, encoding):
    rng = np.random.default_rng(3)
    decoder, sample = decoder_of(name, encoding), SAMPLES[encoding][name]
    for place in rng.integers(0, len(sample), 150):
        damaged = bytearray(sample)
        damaged[place] = rng.integers(0, 256)
        with contextlib.suppress(InputError):
            assert isinstance(decoder.decode(bytes(damaged)), KINDS[decoder.role])


@pytest.mark.parametrize(("name", "encoding"), PAIRS)
@pytest.mark.parametrize("schema", [("ros2msg", b"%$ garbage\n"), ("unknown", b""), ("", b"")])
def test_schema_of_the_file_is_not_needed(name, encoding, schema):
    decoder = decoder_of(name, encoding, schema)
    assert decoder.decode(SAMPLES[encoding][name]) == EXPECTED[name]


@pytest.mark.parametrize("name", SCHEMAS)
def test_unregistered_encoding_is_left_alone(name):
    assert decoder_of(name, "wrong_format") is None
    for encoding in set(ENCODINGS) - set(SCHEMAS[name].encodings):
        assert decoder_of(name, encoding) is None
    assert decoder_of("std_msgs/msg/Float64") is None


@pytest.mark.parametrize("name", SCHEMAS)
def test_schema_has_a_module(name):
    module = import_module(SCHEMAS[name].module)
    assert callable(module.decode)
    assert set(SCHEMAS[name].encodings) <= set(ENCODINGS)
    if SCHEMAS[name].role is Role.IMAGE:
        assert callable(module.decode_head)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_encoding_has_a_module_and_a_schema(encoding):
    assert callable(import_module(ENCODINGS[encoding]).decoder)
    assert any(encoding in row.encodings for row in SCHEMAS.values())


@pytest.mark.parametrize("name", REFUSED)
def test_refused_schema_is_not_read_and_says_what_to_do(name):
    assert plain_name(name) == name
    assert name not in SCHEMAS
    assert decoder_of(name, "cdr") is None
    assert REFUSED[name].advice.startswith("record ")
