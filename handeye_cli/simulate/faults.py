"""What goes wrong while a recording is taken: a table of faults, words and effect in each row.

A fault changes the staging, which is what is really there. The recording goes on to declare what
was meant, so that the two contradict each other in just this way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from handeye_cli.conventions import parse_duration, parse_length
from handeye_cli.errors import UsageError, did_you_mean
from handeye_cli.records import FloatArray, IntArray

_FLAG = "--fault"
_LONGEST_LAG_NS = 3_600_000_000_000
"""An hour: with more a stamp may leave what messages can hold."""


@dataclass(frozen=True)
class Staging:
    """What is really there, as far as it may differ from what the recording declares.

    Attributes:
        names: Names of the N stations.
        target_shift: (N, 3) where the target is at each station, from its own place and along its
            own axes, metres.
        pictured: (N,) index of the station that the picture of each station shows.
        missing: (N,) whether the picture is missing.
        robot_scale: The robot's positions as it tells them, in units of its true ones.
        print_scale: The target as it was printed, in units of its declared size.
        bow: By how much the target's middle stands out towards the camera, metres.
        image_lag_ns: By how much images are stamped too late.
    """

    names: tuple[str, ...]
    target_shift: FloatArray
    pictured: IntArray
    missing: NDArray[np.bool_]
    robot_scale: float = 1.0
    print_scale: float = 1.0
    bow: float = 0.0
    image_lag_ns: int = 0

    @classmethod
    def faultless(cls, names: Sequence[str]) -> Self:
        """Return the staging of stations at which everything is as declared."""
        count = len(names)
        return cls(
            tuple(names), np.zeros((count, 3)), np.arange(count), np.zeros(count, dtype=np.bool_)
        )

    def index(self, name: str) -> int:
        """Return the index of a station; zeros that its name starts with may be left out.

        Raises:
            UsageError: There is no such station.
        """
        stations = {_short(known): index for index, known in enumerate(self.names)}
        if _short(name) not in stations:
            near = did_you_mean(name, list(self.names))
            raise UsageError(
                f"expected one of the stations {', '.join(self.names)}, found {name!r}",
                where=_FLAG,
                hint=f"did you mean {near!r}?" if near else None,
            )
        return stations[_short(name)]


def _short(name: str) -> str:
    return name.lstrip("0") or "0"


@dataclass(frozen=True)
class Fault:
    """One fault, ready to be staged.

    Attributes:
        text: How `--fault` names it.
        effect: Changes the staging.
        values: What the words after its name say.
    """

    text: str
    effect: Callable[..., Staging]
    values: tuple[Any, ...]

    def staged(self, staging: Staging) -> Staging:
        """Return the staging with this fault in it.

        Raises:
            UsageError: It names a station that is not there.
        """
        return self.effect(staging, *self.values)


@dataclass(frozen=True)
class FaultRow:
    """A kind of fault.

    Attributes:
        usage: Its words as people are told to write them.
        example: One such fault.
        readers: One for each word after the name.
        effect: Changes the staging; takes it and what the readers gave.
    """

    usage: str
    example: str
    readers: tuple[Callable[[str], Any], ...]
    effect: Callable[..., Staging]


def parse(text: str) -> Fault:
    """Read a fault such as `moved-plate:5:20mm`.

    Raises:
        UsageError: There is no such fault, or its words are not those that it takes.
    """
    name, *words = text.split(":")
    if name not in FAULTS:
        near = did_you_mean(name, list(FAULTS))
        raise UsageError(
            f"expected one of the faults {', '.join(FAULTS)}, found {name!r}",
            where=_FLAG,
            hint=f"did you mean {FAULTS[near].usage}?" if near else "such as moved-plate:5:20mm",
        )
    row = FAULTS[name]
    if len(words) != len(row.readers):
        raise _wrong(row, text)
    try:
        values = tuple(read(word) for read, word in zip(row.readers, words, strict=True))
    except UsageError as error:
        hint = f"such as {row.example}"
        raise UsageError(error.message, where=f"{_FLAG} {text}", hint=hint) from error
    return Fault(text, row.effect, values)


def stage(names: Sequence[str], faults: Sequence[Fault]) -> Staging:
    """Return what is really there at stations of these names, with some faults one after another.

    Raises:
        UsageError: A fault names a station that is not there.
    """
    staging = Staging.faultless(names)
    for fault in faults:
        staging = fault.staged(staging)
    return staging


def _wrong(row: FaultRow, text: str) -> UsageError:
    return UsageError(
        f"expected {row.usage}, found {text!r}", where=_FLAG, hint=f"such as {row.example}"
    )


def _stations(word: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in word.split(","))
    if not all(names):
        raise UsageError(f"expected names of stations with commas, found {word!r}")
    return names


def _two_stations(word: str) -> tuple[str, ...]:
    names = _stations(word)
    if len(names) != 2 or _short(names[0]) == _short(names[1]):
        raise UsageError(f"expected two different stations, found {word!r}")
    return names


def _station(word: str) -> str:
    names = _stations(word)
    if len(names) != 1:
        raise UsageError(f"expected one station, found {word!r}")
    return names[0]


def _factor(word: str) -> float:
    try:
        factor = float(word)
    except ValueError:
        factor = math.nan
    if not 0.0 < factor < math.inf:
        raise UsageError(f"expected a factor above 0, found {word!r}")
    return factor


def _lag(word: str) -> int:
    lag_ns = parse_duration(word)
    if abs(lag_ns) > _LONGEST_LAG_NS:
        raise UsageError(f"expected a time of at most an hour, found {word!r}")
    return lag_ns


def _move_plate(staging: Staging, name: str, length: float) -> Staging:
    shift = staging.target_shift.copy()
    shift[staging.index(name) :, 0] += length
    return replace(staging, target_shift=shift)


def _swap(staging: Staging, names: tuple[str, str]) -> Staging:
    pair = [staging.index(name) for name in names]
    pictured = staging.pictured.copy()
    pictured[pair] = pictured[pair[::-1]]
    return replace(staging, pictured=pictured)


def _drop(staging: Staging, names: tuple[str, ...]) -> Staging:
    missing = staging.missing.copy()
    missing[[staging.index(name) for name in names]] = True
    return replace(staging, missing=missing)


def _delay_images(staging: Staging, lag_ns: int) -> Staging:
    return replace(staging, image_lag_ns=staging.image_lag_ns + lag_ns)


def _bow(staging: Staging, height: float) -> Staging:
    return replace(staging, bow=staging.bow + height)


def _scale_print(staging: Staging, factor: float) -> Staging:
    return replace(staging, print_scale=staging.print_scale * factor)


def _scale_robot(staging: Staging, factor: float) -> Staging:
    return replace(staging, robot_scale=staging.robot_scale * factor)


FAULTS = {
    "moved-plate": FaultRow(
        "moved-plate:STATION:LENGTH, from that station on, along the plate's x",
        "moved-plate:5:20mm",
        (_station, parse_length),
        _move_plate,
    ),
    "swapped": FaultRow("swapped:STATION,STATION", "swapped:3,7", (_two_stations,), _swap),
    "dropped": FaultRow("dropped:STATION,...", "dropped:2,5", (_stations,), _drop),
    "time-offset": FaultRow("time-offset:TIME", "time-offset:40ms", (_lag,), _delay_images),
    "bowed": FaultRow("bowed:LENGTH", "bowed:1.2mm", (parse_length,), _bow),
    "scaled": FaultRow("scaled:FACTOR", "scaled:1.25", (_factor,), _scale_print),
    "robot-scale": FaultRow("robot-scale:FACTOR", "robot-scale:1.003", (_factor,), _scale_robot),
}
"""Every fault by its name.

`moved-plate` moves the target along its x axis at that station and all after it; a second one with
the opposite length puts it back. `swapped` files two stations' pictures under each other's names.
`dropped` leaves pictures out. `time-offset` stamps images later than they were taken. `bowed` bends
the target into a paraboloid, its middle towards the camera by so much more than its farthest point.
`scaled` prints it larger than is declared. `robot-scale` has the robot tell larger distances than
it moves.
"""
