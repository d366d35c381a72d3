"""Transforms that differ from earlier ones in nothing but their numbers, read at one look.

A robot sends its few links thousands of times, and most of what a payload says is how it is laid
out and what its frames are called. Where all of that is the same as in a payload that was read in
full before, the times and poses stand at the same places, and nothing else has to be looked at.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from handeye_cli.recording.in_order import Place
from handeye_cli.recording.layout import nanoseconds
from handeye_cli.recording.pose_list import PoseList

_MOST = 256
"""Payloads that are kept in mind; a robot has a few."""
_LONGEST = 2**13
"""Bytes of the longest of them."""
_TIME_AND_POSE = 9
"""Numbers with which every transform ends: seconds, nanoseconds, translation and quaternion."""


@dataclass(frozen=True)
class _Known:
    """Payloads of one layout with the same texts.

    Attributes:
        packed: A whole payload: numbers, and what has to be the same as bytes.
        same: Picks the latter.
        expected: What they have to be.
        links: For each transform what picks its time and pose, and what these are added to.
    """

    packed: struct.Struct
    same: itemgetter[Any]
    expected: Any
    links: tuple[tuple[itemgetter[Any], PoseList], ...]

    def add(self, log_time_ns: int, data: bytes) -> bool:
        """Take in a payload of the same length, and return True if it has the same texts."""
        values = self.packed.unpack(data)
        if self.same(values) != self.expected:
            return False
        for pick, poses in self.links:
            seconds, rest, *numbers = pick(values)
            poses.add(log_time_ns, nanoseconds(seconds, rest), numbers)
        return True


class KnownLinks:
    """The payloads of one channel that were read in full."""

    def __init__(self) -> None:
        self._known: dict[int, list[_Known]] = {}
        self._room = _MOST

    def add(self, log_time_ns: int, data: bytes) -> bool:
        """Take in a payload that is known but for its numbers; return False for any other.

        Args:
            log_time_ns: When it was recorded.
            data: A payload.
        """
        for each in self._known.get(len(data), ()):  # noqa: SIM110  a generator takes as long again
            if each.add(log_time_ns, data):
                return True
        return False

    def has_room_for(self, data: bytes) -> bool:
        """Return whether there is room for one more payload, and it is not too long."""
        return self._room > 0 and len(data) <= _LONGEST

    def learn(self, data: bytes, places: Sequence[Place], lists: Sequence[PoseList]) -> None:
        """Keep in mind what is where in a payload of transforms, for which there is room.

        Args:
            data: The payload.
            places: Its numbers and what they are laid out by, in their order.
            lists: What each of its transforms is added to, at least one.
        """
        self._room -= 1
        self._known.setdefault(len(data), []).append(_known(data, places, lists))


def _known(data: bytes, places: Sequence[Place], lists: Sequence[PoseList]) -> _Known:
    packed = struct.Struct(places[0].order + "".join(_codes(places, len(data))))
    kept = [True, *(each.fixed for each in places for _ in range(each.count))]
    same = itemgetter(*(index for index, fixed in enumerate(kept) if fixed))
    numbers = [index for index, fixed in enumerate(kept) if not fixed]
    each = len(numbers) // len(lists)
    last = [numbers[end - _TIME_AND_POSE : end] for end in range(each, len(numbers) + 1, each)]
    links = zip((itemgetter(*indices) for indices in last), lists, strict=True)
    return _Known(packed, same, same(packed.unpack(data)), tuple(links))


def _codes(places: Sequence[Place], size: int) -> Iterator[str]:
    """Yield the format of a payload for `struct`: its beginning, and the places without gaps."""
    at = places[0].start
    yield f"{at}s"
    for place in places:
        yield f"{place.start - at}x"
        yield place.codes
        at = place.stop
    yield f"{size - at}x"
