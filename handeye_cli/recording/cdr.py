"""Messages written as CDR, the encoding of ROS 2."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from handeye_cli.recording.container import Channel
from handeye_cli.recording.messages import Header

_ENCAPSULATION_BYTES = 4
_STAMP = {False: struct.Struct(">iII"), True: struct.Struct("<iII")}
"""Seconds, nanoseconds and length of the frame's name with its final zero, by little-endian."""


def decoder(channel: Channel, definition: str) -> Callable[[bytes], Any]:
    """Return the function that decodes payloads of a channel.

    The definition is ours and not the one in the file: the layout of these messages never changed,
    and the file's may be missing, written in another language, or damaged.

    Args:
        channel: The channel.
        definition: The schema's text as `ros2msg`.

    Raises:
        ValueError: The definition lacks the schema.
    """
    name = channel.schema_name
    schema = Schema(id=1, name=name, encoding="ros2msg", data=definition.encode())
    decode = DecoderFactory().decoder_for("cdr", schema)
    if decode is None:
        raise ValueError(f"no decoder for the definition of {name!r}")
    return decode


def header(data: bytes) -> Header:
    """Return the `std_msgs/Header` a payload starts with.

    Its layout is the same in every release: int32 sec, uint32 nanosec, string frame_id.

    Raises:
        struct.error: The payload is shorter than a header.
        UnicodeDecodeError: The frame's name is not UTF-8.
    """
    little_endian = bool(data[1] & 1) if len(data) > 1 else True
    stamp = _STAMP[little_endian]
    sec, nanosec, length = stamp.unpack_from(data, _ENCAPSULATION_BYTES)
    start = _ENCAPSULATION_BYTES + stamp.size
    if start + length > len(data):
        raise struct.error(f"a frame name of {length} bytes in a message of {len(data)}")
    name = data[start : start + max(length - 1, 0)]
    return Header(sec * 1_000_000_000 + nanosec, name.decode("utf-8"))
