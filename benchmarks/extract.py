"""Detection of disc grids: found, mis-ordered, distance from the images of the true centres, time.

Random views of the paper's 6x6 plate, this project beside OpenCV's findCirclesGrid on the same
pictures and one core; times are those of the processor. `rough` is the finder alone, `handeye` the
finder with the fit of the discs through the camera. Prints a table:

    python benchmarks/extract.py --views 300 --seed 1
    python benchmarks/extract.py --views 60 --seed 1 --sizes 2mp,5mp
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field

import cv2
import numpy as np

from handeye_cli import targets
from handeye_cli.records import Camera
from handeye_cli.simulate.random_views import DiscView, random_view

SIZES = {"vga": (640, 480), "2mp": (1600, 1200), "5mp": (2592, 1944)}
TARGET = "disc-grid:6x6:5mm:4mm"
COLUMNS = 6
FAR_PX = 3.0


@dataclass
class Tally:
    """What one detector did on the views of one size."""

    views: int = 0
    found: int = 0
    wrong: int = 0
    squares: list[float] = field(default_factory=list)
    worst: float = 0.0
    times: list[float] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)


def camera_of(size):
    width, height = size
    focal = 0.86 * width
    distortion = (-0.2, 0.05, 0.0005, -0.0003, 0.0)
    return Camera(width, height, focal, focal, width / 2 - 3.3, height / 2 + 2.1, distortion)


def rough(image, _):
    seen = BOARD.detect(image)
    return (None, seen.reason) if seen.reason else (seen.pixels, "")


def fitted(image, camera):
    seen = BOARD.refine(image, BOARD.detect(image), camera)
    return (None, seen.reason) if seen.reason else (seen.pixels, "")


def opencv(image, _):
    flags = cv2.CALIB_CB_SYMMETRIC_GRID | cv2.CALIB_CB_CLUSTERING
    found, centres = cv2.findCirclesGrid(image, (COLUMNS, COLUMNS), None, flags)
    return (np.reshape(centres, (-1, 2)), "") if found else (None, "not found")


def judge(tally: Tally, view: DiscView, pixels, reason: str, label: str) -> None:
    """Count a view; any turn of the plate is right, a mirrored or mixed order is not."""
    tally.views += 1
    if pixels is None:
        tally.lost.append(f"{label}: {reason}")
        return
    tally.found += 1
    orders = ORDERS if len(pixels) == len(BOARD.points()) else []
    errors = [np.linalg.norm(pixels - view.discs[order], axis=1) for order in orders]
    best = min(errors, key=np.max, default=np.array([np.inf]))
    if best.max() > FAR_PX:
        tally.wrong += 1
        tally.lost.append(f"{label}: {len(pixels)} points, off by {best.max():.1f} px")
        return
    tally.squares.append(float(np.mean(best**2) / 2))
    tally.worst = max(tally.worst, float(best.max()))


def timed(detect, image, camera):
    start = time.process_time()
    result = detect(image, camera)
    return result, time.process_time() - start


def run(size: str, views: int, seed: int, baseline: bool) -> dict[str, Tally]:
    camera = camera_of(SIZES[size])
    centres, scale = BOARD.points(), camera.width / 640
    radii = np.full(len(centres), BOARD.diameter_mm / 2000)
    detectors = {"rough": rough, "handeye": fitted} | ({"OpenCV": opencv} if baseline else {})
    tallies = {name: Tally() for name in detectors}
    for k in range(views):
        rng = np.random.default_rng([seed, camera.width, k])
        view = random_view(camera, centres, radii, rng, width_px=(12.0, 60.0 * scale))
        label = f"view {k} (tilt {np.degrees(view.tilt):.0f} deg, {view.width:.0f} px)"
        for name, detect in detectors.items():
            (pixels, reason), seconds = timed(detect, view.image, camera)
            tallies[name].times.append(seconds)
            judge(tallies[name], view, pixels, reason, label)
    return tallies


def report(size: str, name: str, tally: Tally, baseline: Tally | None) -> str:
    rms = np.sqrt(np.mean(tally.squares)) if tally.squares else np.nan
    median, slow = (1e3 * np.percentile(tally.times, q) for q in (50, 95))
    ratio = ""
    if baseline is not None:
        ratio = f"{np.median(np.divide(baseline.times, tally.times)):6.2f}"
    return (
        f"{size:5} {name:8} {tally.found:5d} / {tally.views:<5d} {tally.wrong:5d} {rms:9.4f} "
        f"{tally.worst:7.3f} {median:8.1f} {slow:8.1f} {ratio}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=100, help="views of each size")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sizes", default="vga,2mp,5mp", help="of vga, 2mp, 5mp")
    parser.add_argument("--no-opencv", action="store_true", help="this project alone")
    parser.add_argument("--lost", action="store_true", help="list the views that were lost")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print("size  detector  found / views wrong  RMS [px]   worst  ms (50 %)   (95 %) x OpenCV")
    for size in options.sizes.split(","):
        tallies = run(size, options.views, options.seed, not options.no_opencv)
        for name, tally in tallies.items():
            other = tallies.get("OpenCV") if name != "OpenCV" else None
            print(report(size, name, tally, other), flush=True)
            if options.lost and name != "OpenCV":
                print("\n".join("    " + line for line in tally.lost))


BOARD = targets.build(targets.parse(TARGET))
ORDERS = BOARD.turns()


if __name__ == "__main__":
    main()
