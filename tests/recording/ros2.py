"""ROS messages written by hand: schema texts, and bytes from the layout of each message.

The bytes are CDR, or those of ROS 1 with another class for `to`.
"""

import struct

HEADER = """std_msgs/Header header
"""
_HEADER_TEXTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
}
_VECTORS = {
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
}
_POSE = {
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"
} | _VECTORS
_POSE_WITH_COVARIANCE = {
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance\n"
} | _POSE
_STAMPED = HEADER + "string child_frame_id\ngeometry_msgs/Transform transform\n"
_TRANSFORM = {
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n"
} | _VECTORS
_FOXGLOVE_HEAD = "builtin_interfaces/Time timestamp\nstring frame_id\n"
_FRAME_TRANSFORM = (
    "builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
)


def _text(root, parts=()):
    rule = "=" * 80
    dependencies = _HEADER_TEXTS | dict(parts)
    return root + "".join(f"{rule}\nMSG: {name}\n{text}" for name, text in dependencies.items())


TEXTS = {
    "sensor_msgs/Image": _text(
        HEADER + "uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
        "uint8[] data\n"
    ),
    "sensor_msgs/CompressedImage": _text(HEADER + "string format\nuint8[] data\n"),
    "sensor_msgs/CameraInfo": _text(
        HEADER + "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
        "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
        "sensor_msgs/RegionOfInterest roi\n",
        {
            "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\n"
            "uint32 width\nbool do_rectify\n"
        },
    ),
    "tf2_msgs/TFMessage": _text(
        "geometry_msgs/TransformStamped[] transforms\n",
        {"geometry_msgs/TransformStamped": _STAMPED} | _TRANSFORM,
    ),
    "tf/tfMessage": _text(
        "geometry_msgs/TransformStamped[] transforms\n",
        {"geometry_msgs/TransformStamped": _STAMPED} | _TRANSFORM,
    ),
    "geometry_msgs/TransformStamped": _text(_STAMPED, _TRANSFORM),
    "geometry_msgs/PoseStamped": _text(HEADER + "geometry_msgs/Pose pose\n", _POSE),
    "geometry_msgs/PoseWithCovarianceStamped": _text(
        HEADER + "geometry_msgs/PoseWithCovariance pose\n", _POSE_WITH_COVARIANCE
    ),
    "nav_msgs/Odometry": _text(
        HEADER + "string child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist\n",
        _POSE_WITH_COVARIANCE
        | {
            "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\n"
            "float64[36] covariance\n",
            "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
        },
    ),
    "sensor_msgs/JointState": _text(
        HEADER + "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    ),
    "std_msgs/String": "string data\n",
    "foxglove.RawImage": _text(
        _FOXGLOVE_HEAD + "uint32 width\nuint32 height\nstring encoding\nuint32 step\nuint8[] data\n"
    ),
    "foxglove.CompressedImage": _text(_FOXGLOVE_HEAD + "uint8[] data\nstring format\n"),
    "foxglove.CameraCalibration": _text(
        _FOXGLOVE_HEAD + "uint32 width\nuint32 height\nstring distortion_model\n"
        "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
    ),
    "foxglove.FrameTransform": _text(_FRAME_TRANSFORM, _VECTORS),
    "foxglove.FrameTransforms": _text(
        "foxglove_msgs/FrameTransform[] transforms\n",
        {"foxglove_msgs/FrameTransform": _FRAME_TRANSFORM} | _VECTORS,
    ),
    "foxglove.PoseInFrame": _text(_FOXGLOVE_HEAD + "geometry_msgs/Pose pose\n", _POSE),
}


class Cdr:
    """Bytes of a message; every number is aligned to its size, counted after the first four."""

    def __init__(self, *, little=True):
        self.order = "<" if little else ">"
        self.bytes = bytearray(b"\x00\x01\x00\x00" if little else b"\x00\x00\x00\x00")

    def put(self, code, *values):
        size = struct.calcsize(code)
        for value in values:
            self.bytes += bytes(-(len(self.bytes) - 4) % size)
            self.bytes += struct.pack(self.order + code, value)
        return self

    def string(self, text):
        raw = text.encode() + b"\0"
        self.put("I", len(raw)).bytes += raw
        return self

    def octets(self, raw):
        self.put("I", len(raw)).bytes += raw
        return self

    def time(self, stamp_ns):
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9)

    def header(self, stamp_ns, frame_id):
        return self.time(stamp_ns).string(frame_id)

    def done(self):
        return bytes(self.bytes)


class Ros1(Cdr):
    """Bytes of a message in ROS 1: nothing is aligned, texts do not end, headers are counted."""

    def __init__(self):
        self.bytes = bytearray()

    def put(self, code, *values):
        self.bytes += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def string(self, text):
        return self.octets(text.encode())

    def time(self, stamp_ns):
        return self.put("I", *divmod(stamp_ns, 10**9))

    def header(self, stamp_ns, frame_id):
        return self.put("I", 77).time(stamp_ns).string(frame_id)


def image(
    stamp_ns, frame_id, pixels, encoding="mono8", *, step=None, data=None, little=True, to=Cdr
):
    height, width = pixels.shape[:2]
    raw = pixels.tobytes() if data is None else data
    step = pixels[0].nbytes if step is None else step
    cdr = (to() if little else to(little=False)).header(stamp_ns, frame_id)
    cdr.put("I", height, width).string(encoding)
    return cdr.put("B", 0).put("I", step).octets(raw).done()


def compressed_image(stamp_ns, frame_id, data, form="png", *, to=Cdr):
    return to().header(stamp_ns, frame_id).string(form).octets(data).done()


def camera_info(
    stamp_ns, frame_id, *, k, d=(), model="plumb_bob", p=(0.0,) * 12, size=(64, 48),
    binning=(0, 0), roi=(0, 0, 0, 0), to=Cdr
):  # fmt: skip
    cdr = to().header(stamp_ns, frame_id).put("I", size[1], size[0]).string(model)
    cdr.put("I", len(d)).put("d", *d, *k, 1, 0, 0, 0, 1, 0, 0, 0, 1, *p).put("I", *binning)
    x, y, width, height = roi
    return cdr.put("I", x, y, height, width).put("B", 0).done()


def transforms(*stamped, to=Cdr):
    """Each is (stamp, parent, child, seven numbers)."""
    cdr = to().put("I", len(stamped))
    for stamp_ns, parent, child, numbers in stamped:
        cdr.header(stamp_ns, parent).string(child).put("d", *numbers)
    return cdr.done()


def transform(stamp_ns, parent, child, numbers, *, to=Cdr):
    return to().header(stamp_ns, parent).string(child).put("d", *numbers).done()


def pose(stamp_ns, frame_id, numbers, *, to=Cdr):
    return to().header(stamp_ns, frame_id).put("d", *numbers).done()


def pose_with_covariance(stamp_ns, frame_id, numbers, *, to=Cdr):
    return to().header(stamp_ns, frame_id).put("d", *numbers, *range(36)).done()


def odometry(stamp_ns, frame_id, child, numbers, *, to=Cdr):
    cdr = to().header(stamp_ns, frame_id).string(child)
    return cdr.put("d", *numbers, *range(36), *range(6), *range(36)).done()


def joint_state(stamp_ns, values, *, to=Cdr):
    """`values` are the positions by the joints' names."""
    cdr = to().header(stamp_ns, "").put("I", len(values))
    for name in values:
        cdr.string(name)
    for numbers in (values.values(), values.values(), [7.5]):
        cdr.put("I", len(numbers))
        cdr.put("d", *numbers)
    return cdr.done()


def text(words, *, to=Cdr):
    return to().string(words).done()


def raw_image(stamp_ns, frame_id, size, data, *, encoding, step, to=Cdr):
    cdr = to().time(stamp_ns).string(frame_id).put("I", *size).string(encoding)
    return cdr.put("I", step).octets(data).done()


def foxglove_compressed_image(stamp_ns, frame_id, data, form, *, to=Cdr):
    return to().time(stamp_ns).string(frame_id).octets(data).string(form).done()


def camera_calibration(stamp_ns, frame_id, *, k, d, model, p, size, to=Cdr):
    cdr = to().time(stamp_ns).string(frame_id).put("I", *size).string(model)
    return cdr.put("I", len(d)).put("d", *d, *k, 1, 0, 0, 0, 1, 0, 0, 0, 1, *p).done()


def frame_transform(stamp_ns, parent, child, numbers, *, to=Cdr):
    return to().time(stamp_ns).string(parent).string(child).put("d", *numbers).done()


def frame_transforms(*stamped, to=Cdr):
    cdr = to().put("I", len(stamped))
    for stamp_ns, parent, child, numbers in stamped:
        cdr.time(stamp_ns).string(parent).string(child).put("d", *numbers)
    return cdr.done()


def pose_in_frame(stamp_ns, frame_id, numbers, *, to=Cdr):
    return to().time(stamp_ns).string(frame_id).put("d", *numbers).done()


STAMP = 12_000_000_345
NUMBERS = (1, 2, 3, 0.5, -0.5, 0.5, 0.5)
TRANSFORMS = (
    (STAMP, "base", "tool", NUMBERS),
    (13_000_000_000, "tool", "camera", (4, 5, 6, 0, 0, 0, 1)),
)


def samples(to):
    """Return a message of every schema, no field having its default."""
    calibration = {
        "k": range(1, 10), "d": (0.1, 0.2), "p": range(12), "size": (640, 480),
        "model": "plumb_bob",
    }  # fmt: skip
    at = (STAMP, "camera")
    return {
        "sensor_msgs/Image": to()
        .header(*at).put("I", 1, 2).string("mono8").put("B", 1).put("I", 3)
        .octets(b"\x07\x08\x09").done(),
        "sensor_msgs/CompressedImage": compressed_image(*at, b"\xff\xd8", "jpeg", to=to),
        "sensor_msgs/CameraInfo": camera_info(
            *at, **calibration, binning=(2, 3), roi=(4, 5, 60, 70), to=to
        ),
        "tf2_msgs/TFMessage": transforms(*TRANSFORMS, to=to),
        "tf/tfMessage": transforms(*TRANSFORMS, to=to),
        "geometry_msgs/TransformStamped": transform(*TRANSFORMS[0], to=to),
        "geometry_msgs/PoseStamped": pose(STAMP, "base", NUMBERS, to=to),
        "geometry_msgs/PoseWithCovarianceStamped": pose_with_covariance(
            STAMP, "base", NUMBERS, to=to
        ),
        "nav_msgs/Odometry": odometry(STAMP, "base", "tool", NUMBERS, to=to),
        "sensor_msgs/JointState": joint_state(STAMP, {"a": 0.5, "elbow": -1.25}, to=to),
        "std_msgs/String": text("<robot/>", to=to),
        "foxglove.RawImage": raw_image(
            *at, (2, 1), b"\x07\x08\x09", encoding="mono8", step=3, to=to
        ),
        "foxglove.CompressedImage": foxglove_compressed_image(*at, b"\xff\xd8", "jpeg", to=to),
        "foxglove.CameraCalibration": camera_calibration(*at, **calibration, to=to),
        "foxglove.FrameTransform": frame_transform(*TRANSFORMS[0], to=to),
        "foxglove.FrameTransforms": frame_transforms(*TRANSFORMS, to=to),
        "foxglove.PoseInFrame": pose_in_frame(STAMP, "base", NUMBERS, to=to),
    }  # fmt: skip


SAMPLES = samples(Cdr)
ROS1_SAMPLES = samples(Ros1)
