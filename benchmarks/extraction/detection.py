"""Discs in cluttered views: found, mis-ordered, distance from the true centres, time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np

from benchmarks.effort import Effort
from benchmarks.processes import timed
from benchmarks.tables import Column, Table
from handeye_cli import targets
from handeye_cli.records import Camera
from handeye_cli.simulate.random_views import DiscView, random_view

SIZES = {"vga": (640, 480), "2mp": (1600, 1200), "5mp": (2592, 1944)}
TARGET = "disc-grid:6x6:5mm:4mm"
BOARD = targets.build(targets.parse(TARGET))
ORDERS = BOARD.turns()
SIDE = 6
FAR_PX = 3.0
COLUMNS_OF_TABLE = (
    Column("size"),
    Column("detector"),
    Column("views", "d"),
    Column("found", "d"),
    Column("wrong", "d"),
    Column("discs lost", "d"),
    Column("RMS [px]", ".4f"),
    Column("worst [px]", ".3f"),
    Column("median [ms]", ".1f"),
    Column("95 % [ms]", ".1f"),
    Column("of decoding", ".2f"),
    Column("OpenCV / it", ".2f"),
    Column("with decoding", ".2f"),
)
NOTE = """Random views of the paper's 6x6 plate, noise of 1 to 4 grey levels, tilts of 0 to 55
deg. All detectors see the same pictures one after the other. `finder` is the search alone,
`handeye` the search with the fit of the discs through the camera, `OpenCV` its findCirclesGrid
with clustering. The last columns are times over that of decoding the PNG, and OpenCV's over the
detector's, without and with the decoding."""


@dataclass
class Tally:
    """What one detector did on the views of one size."""

    views: int = 0
    found: int = 0
    wrong: int = 0
    discs_lost: int = 0
    squares: list[float] = field(default_factory=list)
    worst: float = 0.0
    times: list[float] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)


def camera_of(size):
    width, height = size
    focal = 0.86 * width
    distortion = (-0.2, 0.05, 0.0005, -0.0003, 0.0)
    return Camera(width, height, focal, focal, width / 2 - 3.3, height / 2 + 2.1, distortion)


def finder(image, _):
    return BOARD.detect(image)


def fitted(image, camera):
    return BOARD.refine(image, BOARD.detect(image), camera)


def opencv(image, _):
    flags = cv2.CALIB_CB_SYMMETRIC_GRID | cv2.CALIB_CB_CLUSTERING
    found, centres = cv2.findCirclesGrid(image, (SIDE, SIDE), None, flags)
    if not found:
        return targets.Detection.missing("not found")
    return targets.Detection.whole(np.reshape(centres, (-1, 2)))


def like(seen, truth):
    """The truth in the turn of the plate that a detector took; any turn is right."""
    turns = [truth[order][seen.ids] for order in ORDERS]
    return min(turns, key=lambda turn: np.abs(turn - seen.pixels).max())


def judge(tally: Tally, view: DiscView, seen, label: str) -> None:
    tally.views += 1
    if seen.reason is not None:
        tally.lost.append(f"{label}: {seen.reason}")
        return
    tally.found += 1
    tally.discs_lost += len(view.discs) - len(seen.ids)
    errors = np.linalg.norm(seen.pixels - like(seen, view.discs), axis=1)
    if errors.max() > FAR_PX:
        tally.wrong += 1
        tally.lost.append(f"{label}: {len(seen.ids)} points, off by {errors.max():.1f} px")
        return
    tally.squares.append(float(np.mean(errors**2) / 2))
    tally.worst = max(tally.worst, float(errors.max()))


def views_of(size: str, count: int, seed: int):
    """The camera and its views, the widest discs growing with the image."""
    camera = camera_of(SIZES[size])
    radii = np.full(len(BOARD.points()), BOARD.diameter_mm / 2000)
    widths = (12.0, 60.0 * camera.width / 640)
    for k in range(count):
        rng = np.random.default_rng([seed, camera.width, k])
        yield camera, random_view(camera, BOARD.points(), radii, rng, width_px=widths)


def run(size: str, count: int, seed: int):
    detectors = {"finder": finder, "handeye": fitted, "OpenCV": opencv}
    tallies, decoding = {name: Tally() for name in detectors}, []
    for k, (camera, view) in enumerate(views_of(size, count, seed)):
        _, data = cv2.imencode(".png", view.image)
        decoding.append(timed(cv2.imdecode, data, cv2.IMREAD_GRAYSCALE)[1])
        label = f"view {k} (tilt {np.degrees(view.tilt):.0f} deg, {view.width:.0f} px)"
        for name, detect in detectors.items():
            seen, seconds = timed(detect, view.image, camera)
            tallies[name].times.append(seconds)
            judge(tallies[name], view, seen, label)
    return tallies, np.array(decoding)


def row(size: str, name: str, tally: Tally, decoding, other: Tally):
    rms = np.sqrt(np.mean(tally.squares)) if tally.squares else np.nan
    times, theirs = np.array(tally.times), np.array(other.times)
    counts = (tally.views, tally.found, tally.wrong, tally.discs_lost)
    median, slow = (1e3 * np.percentile(times, q) for q in (50, 95))
    ratio = np.median(theirs) / np.median(times)
    whole = np.median(theirs + decoding) / np.median(times + decoding)
    relative = np.median(times) / np.median(decoding)
    return (size, name, *counts, rms, tally.worst, median, slow, relative, ratio, whole)


def tables(effort: Effort) -> Iterator[Table]:
    cv2.setNumThreads(1)
    rows, lost = [], []
    for size in effort.sizes.split(","):
        tallies, decoding = run(size, effort.views, effort.seed)
        rows += [
            row(size, name, tally, decoding, tallies["OpenCV"]) for name, tally in tallies.items()
        ]
        lost += [
            (size, name, each) for name in ("finder", "handeye") for each in tallies[name].lost
        ]
    yield Table("extraction_discs", "Discs in cluttered views", COLUMNS_OF_TABLE, rows, NOTE)
    if effort.lost:
        heads = (Column("size"), Column("detector"), Column("view and reason"))
        yield Table("extraction_lost", "Views that were lost", heads, lost)
