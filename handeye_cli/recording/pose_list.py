"""Poses of one pair of frames as they come out of a recording, one after the other."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from handeye_cli.recording.transforms import Samples


@dataclass
class PoseList:
    """Samples in compact arrays, for a recording may hold millions.

    Attributes:
        parent: Name of the parent frame.
        child: Name of the child frame.
        static: Whether they came as static transforms.
        lasting: Whether a single one holds for all time.
        stamps_ns: Times in the messages' headers.
        log_times_ns: Times of recording.
        numbers: Seven of each: translation and quaternion x y z w.
    """

    parent: str
    child: str
    static: bool = False
    lasting: bool = False
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    log_times_ns: array[int] = field(default_factory=lambda: array("q"))
    numbers: array[float] = field(default_factory=lambda: array("d"))

    def add(self, log_time_ns: int, stamp_ns: int, numbers: Iterable[float]) -> None:
        """Take in one more pose, of seven numbers."""
        self.stamps_ns.append(stamp_ns)
        self.log_times_ns.append(log_time_ns)
        self.numbers.extend(numbers)

    def finished(self) -> Samples:
        """Return the poses as arrays."""
        return Samples(
            self.parent,
            self.child,
            self.static or (self.lasting and len(self.stamps_ns) == 1),
            np.array(self.stamps_ns, dtype=np.int64),
            np.array(self.log_times_ns, dtype=np.int64),
            np.array(self.numbers, dtype=np.float64).reshape(-1, 7),
        )
