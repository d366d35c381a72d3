"""Which messages can be read: one row for each schema, one for each encoding of payloads.

A row of `SCHEMAS` names a module with `DEFINITION`, the schema's fields, and `decode(message)`,
which turns a generically decoded message into ours. A module of images also has `HEAD_FIELDS`, how
many fields at its start say when and in which frame, and `decode_head(message)` for these. Where
the fields' numbers in protobuf are not in their order, the module has `NUMBERS`.

A row of `ENCODINGS` names a module with `decoder(layout)`, which gives that generic decoder.
"""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.recording.messages import Role

_DECODERS = "handeye_cli.recording.decoders"
_ROS = ("cdr", "ros1")
_FOXGLOVE = ("protobuf", "json", "cdr", "ros1")


@dataclass(frozen=True)
class SchemaRow:
    """How messages of one schema are used and read.

    Attributes:
        role: What they are good for.
        module: Path of the module with `decode`.
        encodings: How they are written.
    """

    role: Role
    module: str
    encodings: tuple[str, ...]


@dataclass(frozen=True)
class RefusedRow:
    """Messages that are not read, though their schema is known.

    Attributes:
        role: What they might be taken for.
        what: What they hold.
        advice: What to record in their place.
    """

    role: Role
    what: str
    advice: str


def _ros(role: Role, module: str) -> SchemaRow:
    return SchemaRow(role, f"{_DECODERS}.{module}", _ROS)


def _foxglove(role: Role, module: str) -> SchemaRow:
    return SchemaRow(role, f"{_DECODERS}.foxglove_{module}", _FOXGLOVE)


SCHEMAS = {
    "sensor_msgs/Image": _ros(Role.IMAGE, "image"),
    "sensor_msgs/CompressedImage": _ros(Role.IMAGE, "compressed_image"),
    "sensor_msgs/CameraInfo": _ros(Role.CAMERA_INFO, "camera_info"),
    "tf2_msgs/TFMessage": _ros(Role.TRANSFORMS, "tf_message"),
    "tf/tfMessage": SchemaRow(Role.TRANSFORMS, f"{_DECODERS}.tf_message", ("ros1",)),
    "geometry_msgs/TransformStamped": _ros(Role.TRANSFORMS, "transform_stamped"),
    "geometry_msgs/PoseStamped": _ros(Role.POSE, "pose_stamped"),
    "geometry_msgs/PoseWithCovarianceStamped": _ros(Role.POSE, "pose_with_covariance_stamped"),
    "nav_msgs/Odometry": _ros(Role.POSE, "odometry"),
    "sensor_msgs/JointState": _ros(Role.JOINTS, "joint_state"),
    "std_msgs/String": _ros(Role.TEXT, "string"),
    "foxglove.RawImage": _foxglove(Role.IMAGE, "raw_image"),
    "foxglove.CompressedImage": _foxglove(Role.IMAGE, "compressed_image"),
    "foxglove.CameraCalibration": _foxglove(Role.CAMERA_INFO, "camera_calibration"),
    "foxglove.FrameTransform": _foxglove(Role.TRANSFORMS, "frame_transform"),
    "foxglove.FrameTransforms": _foxglove(Role.TRANSFORMS, "frame_transforms"),
    "foxglove.PoseInFrame": _foxglove(Role.POSE, "pose_in_frame"),
}
"""By the schema's plain name."""

ENCODINGS = {
    "cdr": "handeye_cli.recording.cdr",
    "ros1": "handeye_cli.recording.ros1",
    "protobuf": "handeye_cli.recording.protobuf",
    "json": "handeye_cli.recording.json_text",
}
"""By the channel's message encoding."""

IN_ORDER = _ROS
"""Encodings in which the fields of a message stand one after the other, a header first."""

_FRAMES = "record the camera's single frames, as raw images, PNG or JPEG"
_ONE_POSE = "record the gripper's own pose: TF, or one stamped pose in a message"
REFUSED = {
    "foxglove.CompressedVideo": RefusedRow(Role.IMAGE, "video", _FRAMES),
    "ffmpeg_image_transport_msgs/FFMPEGPacket": RefusedRow(Role.IMAGE, "video", _FRAMES),
    "theora_image_transport/Packet": RefusedRow(Role.IMAGE, "video", _FRAMES),
    "foxglove.PosesInFrame": RefusedRow(Role.POSE, "several poses in a message", _ONE_POSE),
    "geometry_msgs/PoseArray": RefusedRow(Role.POSE, "several poses in a message", _ONE_POSE),
    "nav_msgs/Path": RefusedRow(Role.POSE, "several poses in a message", _ONE_POSE),
    "geometry_msgs/Pose": RefusedRow(Role.POSE, "poses without time and frame", _ONE_POSE),
}
"""By the schema's plain name: what people may expect to be read."""


def row_of(schema_name: str, message_encoding: str) -> SchemaRow | None:
    """Return the row of a schema in an encoding, or None when there is none."""
    row = SCHEMAS.get(plain_name(schema_name))
    return row if row is not None and message_encoding in row.encodings else None


def refusal_of(schema_name: str) -> RefusedRow | None:
    """Return why messages of a schema are not read, or None."""
    return REFUSED.get(plain_name(schema_name))


def plain_name(schema_name: str) -> str:
    """Return a schema's name without `/msg/`, and Foxglove's own name of its ROS messages."""
    name = schema_name.replace("/msg/", "/")
    return (
        name.replace("foxglove_msgs/", "foxglove.") if name.startswith("foxglove_msgs/") else name
    )
