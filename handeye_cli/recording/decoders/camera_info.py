"""`sensor_msgs/CameraInfo`."""

from __future__ import annotations

from handeye_cli.recording.decoders import ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import CameraInfoMessage

_REGION = {
    "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\n"
    "uint32 width\nbool do_rectify\n"
}
DEFINITION = ros.definition(
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
    "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
    "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
    ros.HEADER | _REGION,
)
"""Its fields, the same in every release of ROS 2; ROS 1 calls four of them D, K, R and P."""


def decode(message: Values) -> CameraInfoMessage:
    """Return a decoded message as ours."""
    roi = message["roi"]
    return CameraInfoMessage(
        header=ros.decode_head(message),
        width=message["width"],
        height=message["height"],
        distortion_model=message["distortion_model"],
        d=tuple(message["d"]),
        k=tuple(message["k"]),
        p=tuple(message["p"]),
        binning_x=message["binning_x"],
        binning_y=message["binning_y"],
        roi=(roi["x_offset"], roi["y_offset"], roi["width"], roi["height"]),
    )
