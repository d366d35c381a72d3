"""Memory and time of `extract` over recordings of different length, with one worker and several."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import cv2
import numpy as np

from benchmarks.effort import Effort, numbers
from benchmarks.processes import alone
from benchmarks.tables import Column, Table
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
HEADS = (
    Column("images", "d"),
    Column("workers", "d"),
    Column("found", "d"),
    Column("clock [s]", ".2f"),
    Column("processor [s]", ".2f"),
    Column("peak [MB]", ".0f"),
    Column("grown [MB]", ".0f"),
    Column("images per worker", ".1f"),
)
NOTE = """Pictures of 5 megapixels. The peak must grow with the workers, and not with the images;
the last column is that growth in bytes of a picture."""


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


def run(folder: Path, images: int, workers: int) -> int:
    stations = tuple(
        RecordedStation(str(k), np.eye(4), ImageFile(folder / f"{k % PICTURES}.png", str(k)))
        for k in range(images)
    )
    recording = Recording(Setup.EYE_IN_HAND, stations, targets.parse(TARGET), camera())
    features = extract(recording, workers=workers)
    return sum(station.observation is not None for station in features.stations)


def row(folder: Path, workers: int, images: int):
    cost = alone(run, folder, images, workers)
    grown = cost.peak - cost.before
    of_picture = grown / (SIZE[0] * SIZE[1]) / workers
    taken = (cost.clock, cost.processor, cost.peak / MB, grown / MB, of_picture)
    return (images, workers, cost.result, *taken)


def tables(effort: Effort) -> Iterator[Table]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        alone(write_pictures, folder)
        cases = product(numbers(effort.workers), numbers(effort.images))
        rows = [row(folder, *case) for case in cases]
    yield Table("extraction_memory", "Memory of an extraction", HEADS, rows, NOTE)
