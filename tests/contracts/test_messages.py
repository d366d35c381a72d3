"""What every registered message schema and encoding must do."""

from importlib import import_module

import pytest
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from recording import ros2

from handeye_cli.errors import InputError
from handeye_cli.recording import messages
from handeye_cli.recording.container import Channel
from handeye_cli.recording.decoding import decoder_for
from handeye_cli.recording.message_table import ENCODINGS, SCHEMAS
from handeye_cli.recording.messages import Header, Role

KINDS = {
    Role.IMAGE: messages.AnyImage,
    Role.CAMERA_INFO: messages.CameraInfoMessage,
    Role.TRANSFORMS: messages.TransformsMessage,
    Role.POSE: messages.PoseStamped,
}
STAMP = Header(12_000_000_345, "camera")
EXPECTED = {
    "sensor_msgs/Image": messages.ImageMessage(STAMP, 1, 2, "mono8", True, 3, b"\x07\x08\x09"),
    "sensor_msgs/CompressedImage": messages.CompressedImageMessage(STAMP, "jpeg", b"\xff\xd8"),
    "sensor_msgs/CameraInfo": messages.CameraInfoMessage(
        STAMP, 640, 480, "plumb_bob", (0.1, 0.2), tuple(range(1, 10)), tuple(range(12)), 2, 3,
        (4, 5, 60, 70),
    ),
    "tf2_msgs/TFMessage": messages.TransformsMessage((
        messages.TransformStamped(
            Header(12_000_000_345, "base"), "tool", (1, 2, 3), (0.5, -0.5, 0.5, 0.5)
        ),
        messages.TransformStamped(
            Header(13_000_000_000, "tool"), "camera", (4, 5, 6), (0, 0, 0, 1)
        ),
    )),
    "geometry_msgs/PoseStamped": messages.PoseStamped(
        Header(12_000_000_345, "base"), (1, 2, 3), (0.5, -0.5, 0.5, 0.5)
    ),
}  # fmt: skip


def channel(name, encoding="cdr"):
    text = ros2.TEXTS[name.replace("/msg/", "/")].encode()
    return Channel("/topic", encoding, name, "ros2msg", text)


@pytest.fixture(params=SCHEMAS)
def name(request):
    return request.param


@pytest.fixture
def sample(name):
    return ros2.SAMPLES[name]


def test_has_a_module_that_decodes(name):
    assert callable(import_module(SCHEMAS[name].module).decode)


@pytest.mark.parametrize("separator", ["/", "/msg/"])
def test_gives_every_field_with_either_spelling_of_the_name(name, sample, separator):
    decoder = decoder_for(channel(name.replace("/", separator)))
    message = decoder.decode(sample)
    assert message == EXPECTED[name]
    assert isinstance(message, KINDS[decoder.role])
    assert hash(message) == hash(EXPECTED[name])


def test_sample_is_what_the_reference_decoder_reads(name, sample):
    schema = Schema(id=1, name=name, encoding="ros2msg", data=ros2.TEXTS[name].encode())
    reference = DecoderFactory().decoder_for("cdr", schema)(sample)
    if name == "tf2_msgs/TFMessage":
        reference = reference.transforms[0]
        ours = EXPECTED[name].transforms[0]
    else:
        ours = EXPECTED[name]
    assert reference.header.frame_id == ours.header.frame_id
    stamp = reference.header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == ours.header.stamp_ns


def test_header_is_read_without_the_rest(name, sample):
    if name == "tf2_msgs/TFMessage":
        pytest.skip("has no header of its own")
    header = decoder_for(channel(name)).header(sample[:60])
    assert header == EXPECTED[name].header


def test_shortened_message_is_refused_unless_only_pixels_are_missing(name, sample):
    decoder = decoder_for(channel(name))
    pixels = len(getattr(EXPECTED[name], "data", b""))
    for length in range(len(sample) - pixels):
        with pytest.raises(InputError, match=r"expected intact .* data") as caught:
            decoder.decode(sample[:length])
        assert caught.value.where == "a message of /topic"


def test_message_compressed_by_itself_is_named(name):
    with pytest.raises(InputError, match="each one compressed by itself"):
        decoder_for(channel(name)).decode(b"\x28\xb5\x2f\xfd1234")


def test_unregistered_encoding_is_left_alone(name):
    assert decoder_for(channel(name, "wrong_format")) is None
    assert decoder_for(Channel("/topic", "cdr", "std_msgs/msg/String", "ros2msg", b"")) is None


@pytest.mark.parametrize("encoding", ["ros2msg", "ros2idl", "unknown"])
def test_schema_text_of_the_file_is_not_needed(name, sample, encoding):
    broken = Channel("/topic", "cdr", name, encoding, b"%$ garbage\n")
    assert decoder_for(broken).decode(sample) == EXPECTED[name]


@pytest.mark.parametrize("message", ENCODINGS)
def test_encoding_has_a_module(message):
    module = import_module(ENCODINGS[message])
    assert callable(module.decoder)
    assert callable(module.header)
