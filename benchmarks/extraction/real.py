"""Real recordings, where the truth is unknown: images found, and how well a pinhole explains them.

The residual is that of intrinsics and poses estimated from the points themselves, with the board
flat and its points where its maker put them, so it has a floor that no detector can go below.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from extraction.detection import timed
from handeye_cli import documents, targets
from handeye_cli.extrinsics import extrinsics
from handeye_cli.records import Features, Observation, Station

HEAD = (
    "recording     images  found rough  fitted  residual rough [px]  fitted [px]  ms rough  + fit"
)


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


def row(path: Path) -> str:
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
    left = [residual(replace(recording), column) for column in columns]
    spent = [1e3 * np.median([seconds for _, seconds in table]) for table in (rough, fitted)]
    return (
        f"{path.parent.name:13} {len(images):6d} {counts[0]:12d} {counts[1]:7d} {left[0]:20.4f} "
        f"{left[1]:12.4f} {spent[0]:9.1f} {spent[1]:6.1f}"
    )


def report(options) -> None:
    folder = Path(options.data)
    recordings = sorted(folder.glob("*/recording.yaml"))
    print(f"Real recordings in {folder.name}" if recordings else "No real recordings: see --data")
    if recordings:
        print(HEAD)
    for path in recordings:
        print(row(path), flush=True)
