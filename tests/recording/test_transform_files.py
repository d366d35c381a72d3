"""Files of transforms, as the official readers have them."""

import io
import json

import jsonschema
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recording import foxglove, ros2
from recording.ros2 import STAMP, TRANSFORMS

from handeye_cli.recording import transform_files
from handeye_cli.recording.messages import Header, TransformStamped

SENT = tuple(
    TransformStamped(Header(stamp, parent), child, numbers[:3], numbers[3:])
    for stamp, parent, child, numbers in TRANSFORMS
)
NOTES = {"method": "park-martin"}
WRITERS = {"ros2": transform_files.write_ros2, "foxglove": transform_files.write_foxglove}


def written(form):
    file = io.BytesIO()
    WRITERS[form](file, SENT, NOTES)
    return file.getvalue()


def reader(form, **options):
    return make_reader(io.BytesIO(written(form)), validate_crcs=True, **options)


def only_message(form):
    ((schema, channel, message),) = reader(form).iter_messages()
    assert message.log_time == message.publish_time == STAMP
    return schema, channel, message.data


def test_tf_is_the_bytes_written_by_hand():
    schema, channel, payload = only_message("ros2")
    assert (schema.name, schema.encoding) == ("tf2_msgs/msg/TFMessage", "ros2msg")
    assert (channel.topic, channel.message_encoding) == ("/tf_static", "cdr")
    assert payload == ros2.SAMPLES["tf2_msgs/TFMessage"]


def test_tf_is_decoded_by_its_schema_alone():
    factories = [DecoderFactory()]
    ((_, _, _, message),) = reader("ros2", decoder_factories=factories).iter_decoded_messages()
    for found, (stamp, parent, child, numbers) in zip(message.transforms, TRANSFORMS, strict=True):
        assert found.header.stamp.sec * 10**9 + found.header.stamp.nanosec == stamp
        assert (found.header.frame_id, found.child_frame_id) == (parent, child)
        t, q = found.transform.translation, found.transform.rotation
        assert (t.x, t.y, t.z, q.x, q.y, q.z, q.w) == numbers


def test_foxglove_is_the_json_of_its_values():
    schema, channel, payload = only_message("foxglove")
    assert (schema.name, schema.encoding) == ("foxglove.FrameTransforms", "jsonschema")
    assert channel.message_encoding == "json"
    assert json.loads(payload) == json.loads(foxglove.JSON_SAMPLES["foxglove.FrameTransforms"])


def test_the_schema_of_foxglove_holds_for_its_message_and_knows_every_field():
    schema, _, payload = only_message("foxglove")
    described, message = json.loads(schema.data), json.loads(payload)
    jsonschema.Draft7Validator.check_schema(described)
    jsonschema.validate(message, described)
    assert described["title"] == "foxglove.FrameTransforms"
    link = described["properties"]["transforms"]["items"]["properties"]
    assert link.keys() == message["transforms"][0].keys()
    message["transforms"][1]["rotation"]["w"] = "1"
    with pytest.raises(jsonschema.ValidationError, match="is not of type 'number'"):
        jsonschema.validate(message, described)


@pytest.mark.parametrize("form", WRITERS)
def test_a_file_has_one_form_and_its_notes(form):
    """`ros2 bag` does not open a file with messages in several encodings."""
    found = reader(form)
    assert found.get_header().profile == ("ros2" if form == "ros2" else "")
    assert len(found.get_summary().channels) == 1
    ((notes),) = found.iter_metadata()
    assert (notes.name, notes.metadata) == ("handeye", NOTES)


@pytest.mark.parametrize("form", WRITERS)
def test_the_same_transforms_give_the_same_bytes(form):
    assert written(form) == written(form)
