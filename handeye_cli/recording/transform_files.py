"""Transforms that hold always, in an MCAP file of their own for ROS 2 or for Foxglove.

A file has one form only: `ros2 bag` refuses a file with messages in several encodings.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO, Any

from mcap.writer import CompressionType, Writer

from handeye_cli import __version__
from handeye_cli.recording import layout
from handeye_cli.recording.decoders import foxglove_frame_transforms
from handeye_cli.recording.messages import TransformsMessage, TransformStamped
from handeye_cli.recording.ros2_channels import PROFILE, STATIC_TOPIC, Ros2Channels, Sent

FOXGLOVE_TOPIC = "/handeye/transforms"
FOXGLOVE_SCHEMA = "foxglove.FrameTransforms"
_TIME_SCHEMA: dict[str, Any] = {
    "type": "object",
    "title": "time",
    "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": layout.SECOND_NS - 1},
    },
}
_KIND_SCHEMAS: dict[layout.Kind, dict[str, Any]] = {
    layout.Kind.TIME: _TIME_SCHEMA,
    layout.Kind.STRING: {"type": "string"},
    layout.Kind.FLOAT64: {"type": "number"},
}


def write_ros2(
    file: IO[bytes], transforms: Sequence[TransformStamped], notes: Mapping[str, str]
) -> None:
    """Write transforms as one `tf2_msgs/msg/TFMessage` on `/tf_static`.

    Args:
        file: An open binary file; the same bytes go into it for the same transforms.
        transforms: At least one; the message is recorded at the time of the first.
        notes: Written into the file beside the message, for people.
    """
    with _started(file, PROFILE, notes) as writer:
        message = TransformsMessage(tuple(transforms))
        Ros2Channels(writer).write(Sent(transforms[0].header.stamp_ns, STATIC_TOPIC, message))


def write_foxglove(
    file: IO[bytes], transforms: Sequence[TransformStamped], notes: Mapping[str, str]
) -> None:
    """Write transforms as one `foxglove.FrameTransforms` in JSON; see `write_ros2`."""
    with _started(file, "", notes) as writer:
        payload = json.dumps({"transforms": [_as_json(each) for each in transforms]}).encode()
        time = transforms[0].header.stamp_ns
        writer.add_message(_foxglove_channel(writer), time, payload, publish_time=time)


@contextmanager
def _started(file: IO[bytes], profile: str, notes: Mapping[str, str]) -> Iterator[Writer]:
    writer = Writer(file, compression=CompressionType.NONE)
    writer.start(profile=profile, library=f"handeye {__version__}")
    yield writer
    writer.add_metadata("handeye", dict(notes))
    writer.finish()  # type: ignore[no-untyped-call]


def _foxglove_channel(writer: Writer) -> int:
    fields = layout.parse(foxglove_frame_transforms.DEFINITION, {})
    schema = {"title": FOXGLOVE_SCHEMA, **_json_schema(fields)}
    schema_id = writer.register_schema(FOXGLOVE_SCHEMA, "jsonschema", json.dumps(schema).encode())
    return writer.register_channel(FOXGLOVE_TOPIC, "json", schema_id)


def _json_schema(fields: layout.Layout) -> dict[str, Any]:
    """Return the JSON Schema of messages, as other tools expect it beside them."""
    return {
        "type": "object",
        "properties": {field.name: _field_schema(field) for field in fields.fields},
    }


def _field_schema(field: layout.Field) -> dict[str, Any]:
    kind = field.kind
    one = _json_schema(kind) if isinstance(kind, layout.Layout) else _KIND_SCHEMAS[kind]
    return {"type": "array", "items": one} if field.count == layout.MANY else one


def _as_json(transform: TransformStamped) -> dict[str, Any]:
    seconds, nanoseconds = layout.seconds_and_rest(transform.header.stamp_ns)
    return {
        "timestamp": {"sec": seconds, "nsec": nanoseconds},
        "parent_frame_id": transform.header.frame_id,
        "child_frame_id": transform.child_frame_id,
        "translation": dict(zip("xyz", transform.translation, strict=True)),
        "rotation": dict(zip("xyzw", transform.rotation, strict=True)),
    }
