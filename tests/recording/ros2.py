"""ROS 2 messages written by hand: schema texts, and CDR bytes from the layout of each message."""

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


def _text(root, **parts):
    rule = "=" * 80
    dependencies = {**_HEADER_TEXTS, **{name.replace("__", "/"): t for name, t in parts.items()}}
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
        sensor_msgs__RegionOfInterest="uint32 x_offset\nuint32 y_offset\nuint32 height\n"
        "uint32 width\nbool do_rectify\n",
    ),
    "tf2_msgs/TFMessage": _text(
        "geometry_msgs/TransformStamped[] transforms\n",
        geometry_msgs__TransformStamped=HEADER
        + "string child_frame_id\ngeometry_msgs/Transform transform\n",
        geometry_msgs__Transform="geometry_msgs/Vector3 translation\n"
        "geometry_msgs/Quaternion rotation\n",
        **_VECTORS,
    ),
    "geometry_msgs/PoseStamped": _text(
        HEADER + "geometry_msgs/Pose pose\n",
        geometry_msgs__Pose="geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
        **_VECTORS,
    ),
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

    def header(self, stamp_ns, frame_id):
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9).string(frame_id)

    def done(self):
        return bytes(self.bytes)


def image(stamp_ns, frame_id, pixels, encoding="mono8", *, step=None, data=None, little=True):
    height, width = pixels.shape[:2]
    raw = pixels.tobytes() if data is None else data
    step = pixels[0].nbytes if step is None else step
    cdr = Cdr(little=little).header(stamp_ns, frame_id).put("I", height, width).string(encoding)
    return cdr.put("B", 0).put("I", step).octets(raw).done()


def compressed_image(stamp_ns, frame_id, data, form="png"):
    return Cdr().header(stamp_ns, frame_id).string(form).octets(data).done()


def camera_info(
    stamp_ns, frame_id, *, k, d=(), model="plumb_bob", p=(0.0,) * 12, size=(64, 48),
    binning=(0, 0), roi=(0, 0, 0, 0)
):  # fmt: skip
    cdr = Cdr().header(stamp_ns, frame_id).put("I", size[1], size[0]).string(model)
    cdr.put("I", len(d)).put("d", *d, *k, 1, 0, 0, 0, 1, 0, 0, 0, 1, *p).put("I", *binning)
    x, y, width, height = roi
    return cdr.put("I", x, y, height, width).put("B", 0).done()


def transforms(*stamped):
    """Each is (stamp, parent, child, seven numbers)."""
    cdr = Cdr().put("I", len(stamped))
    for stamp_ns, parent, child, numbers in stamped:
        cdr.header(stamp_ns, parent).string(child).put("d", *numbers)
    return cdr.done()


def pose(stamp_ns, frame_id, numbers):
    return Cdr().header(stamp_ns, frame_id).put("d", *numbers).done()


SAMPLES = {
    "sensor_msgs/Image": Cdr()
    .header(12_000_000_345, "camera").put("I", 1, 2).string("mono8").put("B", 1).put("I", 3)
    .octets(b"\x07\x08\x09").done(),
    "sensor_msgs/CompressedImage": compressed_image(12_000_000_345, "camera", b"\xff\xd8", "jpeg"),
    "sensor_msgs/CameraInfo": camera_info(
        12_000_000_345, "camera", k=range(1, 10), d=(0.1, 0.2), p=range(12), size=(640, 480),
        binning=(2, 3), roi=(4, 5, 60, 70),
    ),
    "tf2_msgs/TFMessage": transforms(
        (12_000_000_345, "base", "tool", (1, 2, 3, 0.5, -0.5, 0.5, 0.5)),
        (13_000_000_000, "tool", "camera", (4, 5, 6, 0, 0, 0, 1)),
    ),
    "geometry_msgs/PoseStamped": pose(12_000_000_345, "base", (1, 2, 3, 0.5, -0.5, 0.5, 0.5)),
}  # fmt: skip
"""A message of every schema, no field having its default."""
