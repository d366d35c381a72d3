"""The frames of one station as its image: those of a pause, or a single one taken in motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import InputError
from handeye_cli.recording import container, pixels
from handeye_cli.recording.decoding import ChannelDecoder
from handeye_cli.recording.layout import seconds_and_rest
from handeye_cli.recording.messages import CompressedImageMessage, ImageMessage
from handeye_cli.records import GreyImage, IntArray

FRAMES_PER_PAUSE = 5
"""At most this many frames of a pause are averaged: noise falls with the root, time does not."""


@dataclass(frozen=True)
class StationFrames:
    """The mean of some frames of one topic, read from their file only when it is looked at.

    Attributes:
        name: The recording's, for people.
        decoder: Reads messages of the images' channel.
        positions: Where the frames lie in its files.
        time_ns: Time of the first frame.
    """

    name: str
    decoder: ChannelDecoder
    positions: tuple[container.Position, ...]
    time_ns: int

    @property
    def label(self) -> str:
        """Name for people: file, topic and time in seconds."""
        seconds, nanoseconds = seconds_and_rest(self.time_ns)
        return f"{self.name}, {self.decoder.channel.topic} at {seconds}.{nanoseconds:09d} s"

    def load(self) -> GreyImage:
        """Return the (height, width) mean of the frames.

        Raises:
            InputError: A frame cannot be read, or the frames have different sizes.
        """
        payloads = container.read_payloads(self.positions)
        frames = [self._grey(payload) for payload in payloads]
        sizes = {frame.shape for frame in frames}
        if len(sizes) > 1:
            found = ", ".join(f"{width} x {height}" for height, width in sorted(sizes))
            raise InputError(f"expected frames of one size, found {found}", where=self.label)
        return np.rint(np.sum(frames, axis=0, dtype=np.uint32) / len(frames)).astype(np.uint8)

    def _grey(self, payload: bytes) -> GreyImage:
        message = self.decoder.decode(payload)
        if not isinstance(message, ImageMessage | CompressedImageMessage):
            raise TypeError(f"{type(message).__name__} is no image")
        return pixels.to_grey(message, self.label)


def evenly(indices: IntArray, count: int) -> IntArray:
    """Return at most `count` of the (n,) indices, evenly chosen, n > 0."""
    chosen = np.linspace(0, len(indices) - 1, min(count, len(indices)))
    return indices[np.rint(chosen).astype(np.int64)]
