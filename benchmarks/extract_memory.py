"""Memory and time of `extract` over recordings of different length, with one worker and several.

Each row is a process of its own, so that its peak is its own; all its stations show the same few
pictures. The peak must grow with the workers and not with the images. Prints a table:

    python benchmarks/extract_memory.py --images 10,100 --workers 1,2
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.extract import extract
from handeye_cli.images import ImageFile
from handeye_cli.records import Camera, RecordedStation, Recording
from handeye_cli.simulate.random_views import random_view

SIZE = (2592, 1944)
TARGET = "disc-grid:6x6:5mm:4mm:5mm"
PICTURES = 4
MB = 1e6


@dataclass(frozen=True)
class Cost:
    """What one run took: seconds of the clock and of the processors, and bytes at most."""

    found: int
    clock: float
    processor: float
    before: float
    peak: float


def camera():
    width, height = SIZE
    return Camera(width, height, 0.86 * width, 0.86 * width, width / 2, height / 2)


def write_pictures(folder: Path) -> None:
    board = targets.build(targets.parse(TARGET))
    discs = board.drawing().discs
    for k in range(PICTURES):
        rng = np.random.default_rng(k)
        view = random_view(camera(), board.points(), discs[:, 2], rng, width_px=(40.0, 120.0))
        cv2.imwrite(str(folder / f"{k}.png"), view.image)


def peak() -> float:
    scale = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale


def run(folder: Path, images: int, workers: int) -> Cost:
    stations = tuple(
        RecordedStation(str(k), np.eye(4), ImageFile(folder / f"{k % PICTURES}.png", str(k)))
        for k in range(images)
    )
    recording = Recording(Setup.EYE_IN_HAND, stations, targets.parse(TARGET), camera())
    before, clock, processor = peak(), time.perf_counter(), time.process_time()
    features = extract(recording, workers=workers)
    found = sum(station.observation is not None for station in features.stations)
    return Cost(found, time.perf_counter() - clock, time.process_time() - processor, before, peak())


def report(images: int, workers: int, cost: Cost) -> str:
    grown = cost.peak - cost.before
    return (
        f"{images:6d} {workers:7d} {cost.found:5d} {cost.clock:7.2f} {cost.processor:8.2f} "
        f"{cost.peak / MB:8.0f} {grown / MB:9.0f} {grown / (SIZE[0] * SIZE[1]) / workers:12.1f}"
    )


def numbers(text: str) -> list[int]:
    return [int(word) for word in text.split(",")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--images", type=numbers, default=[10, 100], help="stations, N,N,...")
    parser.add_argument("--workers", type=numbers, default=[1, 2], help="workers, N,N,...")
    options = parser.parse_args()
    print("images workers found  clock s  proc. s  peak MB  grown MB images/worker")
    # a process starts with the peak of the one that starts it, so this one does nothing itself
    processes = ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1)
    with tempfile.TemporaryDirectory() as name, processes:
        folder = Path(name)
        processes.submit(write_pictures, folder).result()
        for workers, images in product(options.workers, options.images):
            cost = processes.submit(run, folder, images, workers).result()
            print(report(images, workers, cost), flush=True)


if __name__ == "__main__":
    main()
