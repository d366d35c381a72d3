"""Messages into CDR, the encoding of ROS 2, little-endian.

A number is aligned to its own size, counted after the four bytes that name the encoding. A text or
a sequence is preceded by its length; a text ends with a zero, which is counted.
"""

from __future__ import annotations

import struct
from typing import Self

from handeye_cli.recording.layout import seconds_and_rest
from handeye_cli.recording.messages import (
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    TransformsMessage,
)

_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_EYE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

AnyWritten = ImageMessage | CompressedImageMessage | CameraInfoMessage | TransformsMessage


def encoded(message: AnyWritten) -> bytes:
    """Return the payload of a message."""
    payload = _Payload()
    match message:
        case ImageMessage():
            _put_image(payload, message)
        case CompressedImageMessage():
            payload.header(message.header).text(message.format).octets(message.data)
        case CameraInfoMessage():
            _put_camera_info(payload, message)
        case TransformsMessage():
            _put_transforms(payload, message)
    return bytes(payload.data)


class _Payload:
    """The bytes of a message as they grow."""

    def __init__(self) -> None:
        self.data = bytearray(_LITTLE_ENDIAN)

    def numbers(self, code: str, *values: float) -> Self:
        """Append numbers of one type, by its code in `struct`."""
        size = struct.calcsize(code)
        self.data += bytes(-(len(self.data) - len(_LITTLE_ENDIAN)) % size)
        self.data += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def text(self, text: str) -> Self:
        return self.octets(text.encode("utf-8") + b"\0")

    def octets(self, octets: bytes) -> Self:
        self.numbers("I", len(octets)).data += octets
        return self

    def header(self, header: Header) -> Self:
        seconds, nanoseconds = seconds_and_rest(header.stamp_ns)
        return self.numbers("i", seconds).numbers("I", nanoseconds).text(header.frame_id)


def _put_image(payload: _Payload, image: ImageMessage) -> None:
    payload.header(image.header).numbers("I", image.height, image.width).text(image.encoding)
    payload.numbers("B", image.is_bigendian).numbers("I", image.step).octets(image.data)


def _put_camera_info(payload: _Payload, info: CameraInfoMessage) -> None:
    payload.header(info.header).numbers("I", info.height, info.width).text(info.distortion_model)
    payload.numbers("I", len(info.d)).numbers("d", *info.d, *info.k, *_EYE, *info.p)
    x, y, width, height = info.roi
    payload.numbers("I", info.binning_x, info.binning_y, x, y, height, width).numbers("B", 0)


def _put_transforms(payload: _Payload, message: TransformsMessage) -> None:
    payload.numbers("I", len(message.transforms))
    for each in message.transforms:
        payload.header(each.header).text(each.child_frame_id)
        payload.numbers("d", *each.translation, *each.rotation)
