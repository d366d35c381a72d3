"""Foxglove's messages as plain values, and these as JSON and, by Google's library, as protobuf."""

import base64
import json

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from recording.ros2 import NUMBERS, STAMP, TRANSFORMS

_TYPES = descriptor_pb2.FieldDescriptorProto
_TIME = "google.protobuf.Timestamp"
_FIELDS = {
    "Vector3": "1 double x, 2 double y, 3 double z",
    "Quaternion": "1 double x, 2 double y, 3 double z, 4 double w",
    "Pose": "1 foxglove.Vector3 position, 2 foxglove.Quaternion orientation",
    "CompressedImage": f"1 {_TIME} timestamp, 4 string frame_id, 2 bytes data, 3 string format",
    "RawImage": f"1 {_TIME} timestamp, 7 string frame_id, 2 fixed32 width, 3 fixed32 height, "
    "4 string encoding, 5 fixed32 step, 6 bytes data",
    "CameraCalibration": f"1 {_TIME} timestamp, 9 string frame_id, 2 fixed32 width, "
    "3 fixed32 height, 4 string distortion_model, 5 double[] D, 6 double[] K, 7 double[] R, "
    "8 double[] P",
    "FrameTransform": f"1 {_TIME} timestamp, 2 string parent_frame_id, 3 string child_frame_id, "
    "4 foxglove.Vector3 translation, 5 foxglove.Quaternion rotation",
    "FrameTransforms": "1 foxglove.FrameTransform[] transforms",
    "PoseInFrame": f"1 {_TIME} timestamp, 2 string frame_id, 3 foxglove.Pose pose",
}
"""Number, type and name of the fields of each message in protobuf."""


def _file():
    file = descriptor_pb2.FileDescriptorProto(
        name="foxglove.proto", package="foxglove", syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )  # fmt: skip
    for name, fields in _FIELDS.items():
        message = file.message_type.add(name=name)
        for each in fields.split(", "):
            number, kind, field = each.split()
            one = message.field.add(name=field, number=int(number), label=_TYPES.LABEL_OPTIONAL)
            if kind.endswith("[]"):
                one.label = _TYPES.LABEL_REPEATED
            kind = kind.removesuffix("[]")
            one.type = getattr(_TYPES, "TYPE_" + ("MESSAGE" if "." in kind else kind.upper()))
            if "." in kind:
                one.type_name = "." + kind
    return file


def _pool():
    pool = descriptor_pool.DescriptorPool()
    for file in (descriptor_pb2.FileDescriptorProto(), _file()):
        if not file.name:
            timestamp_pb2.DESCRIPTOR.CopyToProto(file)
        pool.Add(file)
    return pool


_POOL = _pool()


def message_class(name):
    """Return Google's class of `foxglove.*` messages."""
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(name))


def descriptor():
    """Return the schema as a file has it."""
    files = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    files.file.add().CopyFrom(_file())
    return files.SerializeToString()


def as_protobuf(name, values):
    message = message_class(name)()
    _fill(message, values)
    return message.SerializeToString(deterministic=True)


def _fill(message, values):
    for name, value in values.items():
        field = getattr(message, name)
        if name == "timestamp":
            field.FromNanoseconds(value)
        elif isinstance(value, dict):
            field.SetInParent()
            _fill(field, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for each in value:
                _fill(field.add(), each)
        elif isinstance(value, list):
            field.extend(value)
        else:
            setattr(message, name, value)


def as_json(values):
    return json.dumps(_plain("", values)).encode()


def _plain(name, value):
    if name == "timestamp":
        return {"sec": value // 10**9, "nsec": value % 10**9}
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {key: _plain(key, each) for key, each in value.items()}
    return [_plain("", each) for each in value] if isinstance(value, list) else value


def _vector(numbers):
    return dict(zip("xyz", numbers, strict=False))


def _quaternion(numbers):
    return dict(zip("xyzw", numbers[3:], strict=True))


def raw_image(stamp_ns, frame_id, size, data, *, encoding, step):
    return {
        "timestamp": stamp_ns, "frame_id": frame_id, "width": size[0], "height": size[1],
        "encoding": encoding, "step": step, "data": data,
    }  # fmt: skip


def compressed_image(stamp_ns, frame_id, data, form):
    return {"timestamp": stamp_ns, "frame_id": frame_id, "data": data, "format": form}


def camera_calibration(stamp_ns, frame_id, *, k, d, model, p, size):
    return {
        "timestamp": stamp_ns, "frame_id": frame_id, "width": size[0], "height": size[1],
        "distortion_model": model, "D": list(d), "K": list(k), "R": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "P": list(p),
    }  # fmt: skip


def frame_transform(stamp_ns, parent, child, numbers):
    return {
        "timestamp": stamp_ns, "parent_frame_id": parent, "child_frame_id": child,
        "translation": _vector(numbers), "rotation": _quaternion(numbers),
    }  # fmt: skip


def pose_in_frame(stamp_ns, frame_id, numbers):
    pose = {"position": _vector(numbers), "orientation": _quaternion(numbers)}
    return {"timestamp": stamp_ns, "frame_id": frame_id, "pose": pose}


VALUES = {
    "foxglove.RawImage": raw_image(
        STAMP, "camera", (2, 1), b"\x07\x08\x09", encoding="mono8", step=3
    ),
    "foxglove.CompressedImage": compressed_image(STAMP, "camera", b"\xff\xd8", "jpeg"),
    "foxglove.CameraCalibration": camera_calibration(
        STAMP, "camera", k=range(1, 10), d=(0.1, 0.2), p=range(12), size=(640, 480),
        model="plumb_bob",
    ),
    "foxglove.FrameTransform": frame_transform(*TRANSFORMS[0]),
    "foxglove.FrameTransforms": {"transforms": [frame_transform(*each) for each in TRANSFORMS]},
    "foxglove.PoseInFrame": pose_in_frame(STAMP, "base", NUMBERS),
}  # fmt: skip
"""A message of every schema, no field having its default."""
JSON_SAMPLES = {name: as_json(values) for name, values in VALUES.items()}
PROTOBUF_SAMPLES = {name: as_protobuf(name, values) for name, values in VALUES.items()}
