"""`foxglove.CameraCalibration`, which knows neither binning nor a region."""

from __future__ import annotations

from handeye_cli.recording.decoders import foxglove, ros
from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import CameraInfoMessage

DEFINITION = ros.definition(
    foxglove.HEAD + "uint32 width\nuint32 height\nstring distortion_model\n"
    "float64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n",
    {},
)
"""Its fields in the order of ROS, which has the last four in lower case."""
NUMBERS = {
    "frame_id": 9, "width": 2, "height": 3, "distortion_model": 4, "D": 5, "K": 6, "R": 7, "P": 8,
}  # fmt: skip
"""Numbers of its fields in protobuf where they are not in this order."""


def decode(message: Values) -> CameraInfoMessage:
    """Return a decoded message as ours."""
    return CameraInfoMessage(
        header=foxglove.decode_head(message),
        width=message["width"],
        height=message["height"],
        distortion_model=message["distortion_model"],
        d=tuple(message["D"]),
        k=tuple(message["K"]),
        p=tuple(message["P"]),
        binning_x=0,
        binning_y=0,
        roi=(0, 0, 0, 0),
    )
