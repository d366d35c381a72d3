"""From the pixels of a message to a grey image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.errors import InputError
from handeye_cli.images import decode_grey, eight_bits
from handeye_cli.recording.messages import AnyImage, CompressedImageMessage, ImageMessage
from handeye_cli.records import GreyImage

Samples = NDArray[np.uint8] | NDArray[np.uint16]

_DEPTH = ("16UC1", "32FC1", "64FC1")
_COMPRESSED_DEPTH = "compressedDepth"
_FILE_MAGICS = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")
"""The first bytes of a PNG and of a JPEG file."""


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


def _only_channel(samples: Samples) -> GreyImage:
    return np.ascontiguousarray(samples[..., 0], dtype=np.uint8)


def _deep_channel(samples: Samples) -> GreyImage:
    return eight_bits(samples[..., 0].astype(np.uint16, copy=False))


def _converted(code: str) -> Callable[[Samples], GreyImage]:
    def convert(samples: Samples) -> GreyImage:
        import cv2

        return np.asarray(cv2.cvtColor(samples, getattr(cv2, code)), dtype=np.uint8)

    return convert


_ENCODINGS = {
    "mono8": _Encoding(1, _only_channel),
    "8UC1": _Encoding(1, _only_channel),
    "mono16": _Encoding(1, _deep_channel, wide=True),
    "rgb8": _Encoding(3, _converted("COLOR_RGB2GRAY")),
    "bgr8": _Encoding(3, _converted("COLOR_BGR2GRAY")),
    "8UC3": _Encoding(3, _converted("COLOR_BGR2GRAY")),
    "rgba8": _Encoding(4, _converted("COLOR_RGBA2GRAY")),
    "bgra8": _Encoding(4, _converted("COLOR_BGRA2GRAY")),
    "bayer_rggb8": _Encoding(1, _converted("COLOR_BayerRGGB2GRAY")),
    "bayer_bggr8": _Encoding(1, _converted("COLOR_BayerBGGR2GRAY")),
    "bayer_gbrg8": _Encoding(1, _converted("COLOR_BayerGBRG2GRAY")),
    "bayer_grbg8": _Encoding(1, _converted("COLOR_BayerGRBG2GRAY")),
}


def refusal(message: AnyImage) -> str | None:
    """Return why images of this encoding cannot be used, naming it, or None when they can."""
    if isinstance(message, CompressedImageMessage):
        return _compressed_refusal(message)
    if message.encoding in _DEPTH:
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


def _compressed_refusal(message: CompressedImageMessage) -> str | None:
    if _COMPRESSED_DEPTH in message.format:
        return f"the format {message.format!r}, which holds depths and no picture"
    if not message.data.startswith(_FILE_MAGICS):
        return f"neither PNG nor JPEG but data that start with {message.data[:4]!r}"
    return None


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
