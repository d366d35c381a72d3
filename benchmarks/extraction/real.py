"""Real recordings, where the truth is unknown: how well a pinhole explains what was found."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.effort import Effort
from benchmarks.processes import timed
from benchmarks.tables import Column, Table
from handeye_cli import documents, targets
from handeye_cli.extrinsics import extrinsics
from handeye_cli.records import Features, Observation, Station

HEADS = (
    Column("recording"),
    Column("images", "d"),
    Column("found", "d"),
    Column("found and fitted", "d"),
    Column("residual, found [px]", ".4f"),
    Column("fitted [px]", ".4f"),
    Column("find [ms]", ".1f"),
    Column("fit [ms]", ".1f"),
)
NOTE = """The residual is that of intrinsics and poses estimated from the points themselves, with
the board flat and its points where its maker put them, so it has a floor that no detector can go
below."""


def features_of(recording, seen):
    stations = tuple(
        Station(each.name, each.base_T_gripper, reason=found.reason)
        if found.reason
        else Station(each.name, each.base_T_gripper, Observation(found.ids, found.pixels))
        for each, found in zip(recording.stations, seen, strict=True)
    )
    camera = recording.camera
    return Features(
        recording.setup, stations, recording.target, camera, (camera.width, camera.height)
    )


def residual(recording, seen) -> float:
    found = extrinsics(features_of(recording, seen), calibrate_intrinsics=True)
    sigmas = [each.observation.sigma_px for each in found.stations if each.camera_T_target]
    return float(np.median(sigmas))


def row(path: Path):
    recording = documents.read(path)
    board = targets.build(recording.target)
    images = [station.image.load() for station in recording.stations]
    rough = [timed(board.detect, image) for image in images]
    fitted = [
        timed(board.refine, image, seen, recording.camera)
        for image, (seen, _) in zip(images, rough, strict=True)
    ]
    columns = [[seen for seen, _ in table] for table in (rough, fitted)]
    counts = [sum(seen.reason is None for seen in column) for column in columns]
    left = [residual(recording, column) for column in columns]
    spent = [1e3 * np.median([seconds for _, seconds in table]) for table in (rough, fitted)]
    return (path.parent.name, len(images), *counts, *left, *spent)


def tables(effort: Effort) -> Iterator[Table]:
    cv2.setNumThreads(1)
    recordings = sorted(Path(effort.data).glob("*/recording.yaml"))
    rows = [row(path) for path in recordings]
    if rows:
        yield Table("extraction_real", "Real recordings", HEADS, rows, NOTE)
