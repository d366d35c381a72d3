"""From the pixels of a message to a grey image."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.errors import InputError
from handeye_cli.images import decode_grey, eight_bits
from handeye_cli.recording.messages import AnyImage, CompressedImageMessage, ImageMessage
from handeye_cli.records import GreyImage

Samples = NDArray[np.uint8] | NDArray[np.uint16]

_DEPTH = ("32FC1", "64FC1")
_MAYBE_DEPTH = "16UC1"
"""What grey levels of sixteen bits and depths in millimetres are both called."""
_COMPRESSED_DEPTH = "compressedDepth"
_FILE_STARTS = {
    "PNG": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "JPEG": re.compile(rb"\xff\xd8\xff"),
    "TIFF": re.compile(rb"II\*\0|MM\0\*"),
    "WebP": re.compile(rb"RIFF....WEBP", re.DOTALL),
    "AVIF": re.compile(rb"....ftypavi[fs]", re.DOTALL),
}
"""The first bytes of image files."""


@dataclass(frozen=True)
class _Encoding:
    """How raw pixels are laid out.

    Attributes:
        channels: Samples for a pixel.
        to_grey: From (height, width, channels) samples to the grey image.
        wide: Whether a sample has 16 bits.
    """

    channels: int
    to_grey: Callable[[Samples], GreyImage]
    wide: bool = False


def _channel(index: int) -> Callable[[Samples], GreyImage]:
    def take(samples: Samples) -> GreyImage:
        return np.ascontiguousarray(samples[..., index], dtype=np.uint8)

    return take


def _deep_channel(samples: Samples) -> GreyImage:
    return eight_bits(samples[..., 0].astype(np.uint16, copy=False))


def _converted(code: str) -> Callable[[Samples], GreyImage]:
    def convert(samples: Samples) -> GreyImage:
        import cv2

        grey = cv2.cvtColor(samples, getattr(cv2, code))
        return eight_bits(grey.view(np.uint16)) if grey.dtype == np.uint16 else grey.view(np.uint8)

    return convert


def _colours(letters: str) -> dict[str, _Encoding]:
    """Return the encodings of a colour model, its samples having 8 or 16 bits."""
    convert = _converted(f"COLOR_{letters.upper()}2GRAY")
    return {
        f"{letters}8": _Encoding(len(letters), convert),
        f"{letters}16": _Encoding(len(letters), convert, wide=True),
    }


def _mosaics(letters: str) -> dict[str, _Encoding]:
    """Return the encodings of the colours of a 2 x 2 mosaic, its samples having 8 or 16 bits."""
    convert = _converted(f"COLOR_Bayer{letters.upper()}2GRAY")
    return {
        f"bayer_{letters}8": _Encoding(1, convert),
        f"bayer_{letters}16": _Encoding(1, convert, wide=True),
    }


_UYVY, _YUYV = _Encoding(2, _channel(1)), _Encoding(2, _channel(0))
_LUMA_FIRST = _Encoding(1, _channel(0))
"""A plane of grey levels, and after it one of colours."""
_ENCODINGS = {
    "mono8": _Encoding(1, _channel(0)),
    "8UC1": _Encoding(1, _channel(0)),
    "mono16": _Encoding(1, _deep_channel, wide=True),
    _MAYBE_DEPTH: _Encoding(1, _deep_channel, wide=True),
    **_colours("rgb"),
    **_colours("bgr"),
    **_colours("rgba"),
    **_colours("bgra"),
    "8UC3": _Encoding(3, _converted("COLOR_BGR2GRAY")),
    **_mosaics("rggb"),
    **_mosaics("bggr"),
    **_mosaics("gbrg"),
    **_mosaics("grbg"),
    "yuv422": _UYVY,
    "uyvy": _UYVY,
    "yuv422_yuy2": _YUYV,
    "yuyv": _YUYV,
    "nv12": _LUMA_FIRST,
    "nv21": _LUMA_FIRST,
    "nv24": _LUMA_FIRST,
}


def refusal(message: AnyImage, topic: str = "") -> str | None:
    """Return why images of this encoding cannot be used, naming it, or None when they can.

    Args:
        message: An image, whose pixels may be missing but for the first bytes.
        topic: Its topic, whose name may tell depths from grey levels.
    """
    if isinstance(message, CompressedImageMessage):
        return _compressed_refusal(message, topic)
    if _holds_depths(message.encoding, topic):
        return f"the encoding {message.encoding!r}, which holds depths and no picture"
    if message.encoding not in _ENCODINGS:
        return f"the encoding {message.encoding!r}; readable are {', '.join(_ENCODINGS)}"
    return None


def to_grey(message: AnyImage, label: str) -> GreyImage:
    """Return the (height, width) grey image of a message.

    Args:
        message: A raw or compressed image.
        label: Name of the image for people.

    Raises:
        InputError: The encoding cannot be used, or there are fewer bytes than pixels.
    """
    reason = refusal(message)
    if reason:
        raise refused(reason, label)
    if isinstance(message, CompressedImageMessage):
        return decode_grey(message.data, label)
    encoding = _ENCODINGS[message.encoding]
    return encoding.to_grey(_samples(message, encoding, label))


def refused(reason: str, label: str) -> InputError:
    """Return the error for images that cannot be used."""
    return InputError(
        f"expected a grey or colour image, found {reason}",
        where=label,
        hint="choose another topic with --image-topic, or record the camera as mono8 or as PNG",
    )


def _compressed_refusal(message: CompressedImageMessage, topic: str) -> str | None:
    original = message.format.split(";")[0].strip()
    if _COMPRESSED_DEPTH in message.format or _holds_depths(original, topic):
        return f"the format {message.format!r}, which holds depths and no picture"
    if not any(start.match(message.data) for start in _FILE_STARTS.values()):
        return f"none of {', '.join(_FILE_STARTS)} but data that start with {message.data[:4]!r}"
    return None


def _holds_depths(encoding: str, topic: str) -> bool:
    return encoding in _DEPTH or (encoding == _MAYBE_DEPTH and "depth" in topic.lower())


def _samples(message: ImageMessage, encoding: _Encoding, label: str) -> Samples:
    """Return the (height, width, channels) samples, without the padding of the rows."""
    height, width, step = message.height, message.width, message.step
    depth = 2 if encoding.wide else 1
    row = width * encoding.channels * depth
    if not height or not width or step < row or len(message.data) < step * height:
        raise InputError(
            f"expected {height} rows of {step} bytes for {width} x {height} pixels of"
            f" {message.encoding!r}, found {len(message.data)} bytes",
            where=label,
            hint="the message is damaged or its sender is wrong about `step`",
        )
    rows = np.frombuffer(message.data, dtype=np.uint8, count=step * height).reshape(height, step)
    pixels = np.ascontiguousarray(rows[:, :row])
    if encoding.wide:
        order = ">u2" if message.is_bigendian else "<u2"
        return pixels.view(order).astype(np.uint16).reshape(height, width, encoding.channels)
    return pixels.reshape(height, width, encoding.channels)
