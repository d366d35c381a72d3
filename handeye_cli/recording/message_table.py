"""Which messages can be read: one row for each schema, one for each encoding of payloads.

A row of `SCHEMAS` names a module with `DEFINITION`, the schema's text, and `decode(message)`,
which turns a generically decoded message into ours. A row of `ENCODINGS` names a module with
`decoder(channel, definition)`, which gives that generic decoder, and `header(data)`, which reads
the header without touching the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.recording.messages import Role


@dataclass(frozen=True)
class SchemaRow:
    """How messages of one schema are used and read.

    Attributes:
        role: What they are good for.
        module: Path of the module with `decode`.
    """

    role: Role
    module: str


_DECODERS = "handeye_cli.recording.decoders"

SCHEMAS = {
    "sensor_msgs/Image": SchemaRow(Role.IMAGE, f"{_DECODERS}.image"),
    "sensor_msgs/CompressedImage": SchemaRow(Role.IMAGE, f"{_DECODERS}.compressed_image"),
    "sensor_msgs/CameraInfo": SchemaRow(Role.CAMERA_INFO, f"{_DECODERS}.camera_info"),
    "tf2_msgs/TFMessage": SchemaRow(Role.TRANSFORMS, f"{_DECODERS}.tf_message"),
    "geometry_msgs/PoseStamped": SchemaRow(Role.POSE, f"{_DECODERS}.pose_stamped"),
}
"""By the schema's name without `/msg/`, which only some writers put in."""

ENCODINGS = {"cdr": "handeye_cli.recording.cdr"}
"""By the channel's message encoding."""


def row_of(schema_name: str) -> SchemaRow | None:
    """Return the row of a schema, its name written with or without `/msg/`, or None."""
    return SCHEMAS.get(schema_name.replace("/msg/", "/"))
