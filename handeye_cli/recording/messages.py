"""The messages a recording is made of, the same for every way they may have been written."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """What a message is good for."""

    IMAGE = "image"
    CAMERA_INFO = "camera-info"
    TRANSFORMS = "transforms"
    POSE = "pose"
    JOINTS = "joints"
    TEXT = "text"


@dataclass(frozen=True)
class Header:
    """When and in which frame.

    Attributes:
        stamp_ns: Nanoseconds since the epoch of the sender's clock; 0 when it set none.
        frame_id: Name of the frame.
    """

    stamp_ns: int
    frame_id: str


@dataclass(frozen=True)
class ImageMessage:
    """An image as rows of raw pixels.

    Attributes:
        header: Time and camera frame.
        height: Rows.
        width: Columns.
        encoding: Such as `mono8`.
        is_bigendian: Byte order of pixels wider than a byte.
        step: Bytes from one row to the next.
        data: The rows.
    """

    header: Header
    height: int
    width: int
    encoding: str
    is_bigendian: bool
    step: int
    data: bytes


@dataclass(frozen=True)
class CompressedImageMessage:
    """An image as a compressed file.

    Attributes:
        header: Time and camera frame.
        format: The sender's words for it; not reliable.
        data: The file.
    """

    header: Header
    format: str
    data: bytes


@dataclass(frozen=True)
class CameraInfoMessage:
    """Intrinsics of a camera; K and P are for the full image, before binning and region.

    Attributes:
        header: Time and camera frame.
        width: Columns of the full image.
        height: Rows of the full image.
        distortion_model: Such as `plumb_bob`.
        d: Distortion coefficients.
        k: 3x3 camera matrix, row by row; k[0] is 0 when the camera is not calibrated.
        p: 3x4 projection matrix of the rectified image, row by row.
        binning_x: Full columns for a column of the image; 0 means 1.
        binning_y: Full rows for a row of the image; 0 means 1.
        roi: Region of the full image: x offset, y offset, width, height; 0 x 0 means all of it.
    """

    header: Header
    width: int
    height: int
    distortion_model: str
    d: tuple[float, ...]
    k: tuple[float, ...]
    p: tuple[float, ...]
    binning_x: int
    binning_y: int
    roi: tuple[int, int, int, int]


@dataclass(frozen=True)
class TransformStamped:
    """`parent_T_child`, the parent being the header's frame.

    Attributes:
        header: Time and parent frame.
        child_frame_id: Name of the child frame.
        translation: Metres.
        rotation: Quaternion x y z w, as it was sent.
    """

    header: Header
    child_frame_id: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


@dataclass(frozen=True)
class TransformsMessage:
    """Transforms that were sent together.

    Attributes:
        transforms: The transforms.
        lasting: Whether each holds until it is sent anew, so that one sent once holds always.
    """

    transforms: tuple[TransformStamped, ...]
    lasting: bool = False


@dataclass(frozen=True)
class PoseStamped:
    """Pose of a frame in the header's frame.

    Attributes:
        header: Time and frame.
        translation: Metres.
        rotation: Quaternion x y z w, as it was sent.
        child_frame_id: Name of the frame it is the pose of; empty when it has none.
    """

    header: Header
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    child_frame_id: str = ""


@dataclass(frozen=True)
class JointsMessage:
    """Where some joints of a robot are.

    Attributes:
        header: Time.
        positions: Name and value of each, radians or metres.
    """

    header: Header
    positions: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class TextMessage:
    """A text, such as a robot's description.

    Attributes:
        text: The text.
    """

    text: str


AnyImage = ImageMessage | CompressedImageMessage
Message = (
    AnyImage | CameraInfoMessage | TransformsMessage | PoseStamped | JointsMessage | TextMessage
)
