"""How much is measured: everything that a benchmark can be told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@dataclass(frozen=True)
class Effort:
    """Sizes of the benchmarks; each field is a flag of that name.

    Attributes:
        seed: Of all chance.
        views: Rendered views of each size.
        sizes: Of the images, of vga, 2mp and 5mp.
        lost: Whether the views are listed in which the target was not found.
        data: Folder of real recordings.
        images: Stations of recordings whose extraction is watched for its memory.
        workers: Processes of that extraction.
        trials: Simulated calibrations of each layout.
        largest: Most stations of one solution.
        planned: Stations of the plans.
        gigabytes: Of an MCAP recording before packing.
        layouts: Of that file, of zstd, lz4, chunks, no-crc and unchunked.
        folder: For that file, which is deleted in the end.
        recordings: Different inputs of the processes whose start-up is measured.
        runs: Of each such process with each input.
    """

    seed: int = 1
    views: int = 60
    sizes: str = "vga,2mp,5mp"
    lost: bool = False
    data: str = str(_DATA)
    images: str = "10,100"
    workers: str = "1,2"
    trials: int = 1000
    largest: int = 8000
    planned: str = "3,5,7,9,13,21"
    gigabytes: float = 5.0
    layouts: str = "zstd,chunks"
    folder: str = ""
    recordings: int = 5
    runs: int = 9


FULL = Effort()
QUICK = Effort(
    views=3,
    sizes="vga",
    images="4",
    workers="1",
    trials=50,
    largest=100,
    planned="3,7",
    gigabytes=0.05,
    layouts="zstd",
    recordings=5,
    runs=1,
)
"""Enough to see that all of it runs."""


def numbers(text: str) -> list[int]:
    """Return the numbers of a list such as `10,100`."""
    return [int(word) for word in text.split(",")]
