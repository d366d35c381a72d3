"""A PoseArray of our own writing, read with struct and by the official decoder."""

import io
import struct

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from handeye_cli.recording.pose_array import SCHEMA, TOPIC, mcap_bytes, payload


def poses(count):
    return np.random.default_rng(13).normal(size=(count, 7))


@pytest.mark.parametrize("frame", ["base", "target", "a", "seven_b", ""])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_by_hand(frame, count):
    data = payload(poses(count), frame)
    assert data[:4] == b"\x00\x01\x00\x00"
    body = data[4:]
    assert struct.unpack_from("<iII", body) == (0, 0, len(frame) + 1)
    at = 12 + len(frame) + 1
    assert body[12:at] == frame.encode() + b"\0"
    at += -at % 4
    assert struct.unpack_from("<I", body, at) == (count,)
    at += 4
    at += -at % 8 if count else 0
    assert len(body) == at + 56 * count
    numbers = struct.unpack_from(f"<{7 * count}d", body, at)
    np.testing.assert_array_equal(numbers, poses(count).ravel())


def test_by_the_official_decoder():
    wanted = poses(4)
    reader = make_reader(
        io.BytesIO(mcap_bytes(wanted, "base")), decoder_factories=[DecoderFactory()]
    )
    assert reader.get_header().profile == "ros2"
    [(schema, channel, message, decoded)] = list(reader.iter_decoded_messages())
    assert (schema.name, schema.encoding, channel.topic) == (SCHEMA, "ros2msg", TOPIC)
    assert (message.log_time, decoded.header.frame_id) == (0, "base")
    found = [
        [each.position.x, each.position.y, each.position.z, each.orientation.x,
         each.orientation.y, each.orientation.z, each.orientation.w]
        for each in decoded.poses
    ]  # fmt: skip
    np.testing.assert_array_equal(found, wanted)


def test_the_same_poses_are_the_same_bytes():
    assert mcap_bytes(poses(3), "base") == mcap_bytes(poses(3), "base")
