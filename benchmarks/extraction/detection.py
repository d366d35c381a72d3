"""Discs in cluttered views: found, mis-ordered, distance from the true centres, time.

Random views of the paper's 6x6 plate. Detectors see the same pictures one after the other; times
are those of the processor, on one core. `finder` is the search alone, `handeye` the search with the
fit of the discs through the camera, `OpenCV` its findCirclesGrid with clustering. The last columns
are OpenCV's time over the detector's, without and with the reading of the PNG.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import cv2
import numpy as np

from handeye_cli import targets
from handeye_cli.records import Camera
from handeye_cli.simulate.random_views import DiscView, random_view

SIZES = {"vga": (640, 480), "2mp": (1600, 1200), "5mp": (2592, 1944)}
TARGET = "disc-grid:6x6:5mm:4mm"
BOARD = targets.build(targets.parse(TARGET))
ORDERS = BOARD.turns()
COLUMNS = 6
FAR_PX = 3.0
HEAD = (
    "size  detector  found / views  wrong  discs lost  RMS [px]   worst  ms (50 %)   (95 %)"
    "  of PNG  x OpenCV  with PNG"
)


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
    found, centres = cv2.findCirclesGrid(image, (COLUMNS, COLUMNS), None, flags)
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


def timed(function, *arguments):
    start = time.process_time()
    result = function(*arguments)
    return result, time.process_time() - start


def views_of(size: str, count: int, seed: int):
    """The camera and its views, the widest discs growing with the image."""
    camera = camera_of(SIZES[size])
    radii = np.full(len(BOARD.points()), BOARD.diameter_mm / 2000)
    widths = (12.0, 60.0 * camera.width / 640)
    for k in range(count):
        rng = np.random.default_rng([seed, camera.width, k])
        yield camera, random_view(camera, BOARD.points(), radii, rng, width_px=widths)


def run(size: str, count: int, seed: int, baseline: bool):
    detectors = {"finder": finder, "handeye": fitted} | ({"OpenCV": opencv} if baseline else {})
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


def row(size: str, name: str, tally: Tally, decoding, other: Tally | None) -> str:
    rms = np.sqrt(np.mean(tally.squares)) if tally.squares else np.nan
    times = np.array(tally.times)
    median, slow = (1e3 * np.percentile(times, q) for q in (50, 95))
    ratios = ""
    if other is not None:
        theirs = np.array(other.times)
        whole = np.median(theirs + decoding) / np.median(times + decoding)
        ratios = f"{np.median(theirs) / np.median(times):9.2f} {whole:9.2f}"
    return (
        f"{size:5} {name:8} {tally.found:6d} / {tally.views:<5d} {tally.wrong:6d} "
        f"{tally.discs_lost:11d} {rms:9.4f} {tally.worst:7.3f} {median:10.1f} {slow:8.1f} "
        f"{np.median(times) / np.median(decoding):7.2f} {ratios}"
    )


def report(options) -> None:
    print("Cluttered views, noise of 1 to 4 grey levels, tilts of 0 to 55 deg")
    print(HEAD)
    for size in options.sizes.split(","):
        tallies, decoding = run(size, options.views, options.seed, not options.no_opencv)
        for name, tally in tallies.items():
            other = tallies.get("OpenCV") if name != "OpenCV" else None
            print(row(size, name, tally, decoding, other), flush=True)
            if options.lost and name != "OpenCV" and tally.lost:
                print("\n".join("    " + line for line in tally.lost))
