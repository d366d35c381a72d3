"""Draws the frames of both setups, and takes the picture of a report for the README.

    python docs/figures/make.py frames
    python docs/figures/make.py report CHROMIUM

The first needs the extra `plot`. The second writes the report of the sample recording and takes a
picture of its first screen with the browser that is named, such as `/usr/bin/chromium`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
SAMPLE = "sample_data/paper-plate/recording.yaml"
SCREEN = (1000, 1130)
"""Pixels of the picture of a report."""

Point = tuple[float, float]

RED, GREEN, BLUE, INK, GREY = "#c62828", "#2e7d32", "#1565c0", "#212121", "#757575"
STEEL, ANSWER = "#b0bec5", "#e65100"
ARM = 0.55
"""Length of an axis."""


@dataclass(frozen=True)
class Frame:
    """A frame as it is drawn.

    Attributes:
        name: Its name.
        at: Its origin.
        axes: Ends of its x, y and z axis, relative to the origin, in axis lengths.
        label: Where its name stands, relative to the origin.
    """

    name: str
    at: Point
    axes: tuple[Point, Point, Point]
    label: Point


UPRIGHT = ((0.9, -0.25), (0.55, 0.5), (0.0, 1.0))
DOWNWARD = ((0.9, -0.25), (-0.55, -0.5), (0.0, -1.0))
"""Axes of a camera that looks down, of a gripper that points down, and of a plate seen by them."""
FORWARD = ((-0.55, -0.5), (0.0, -1.0), (0.9, -0.25))
"""Axes of a camera that looks to the right, and of a plate that stands in its view."""

IN_HAND = {
    "base": Frame("base", (0.5, 0.4), UPRIGHT, (-0.1, -0.32)),
    "gripper": Frame("gripper", (2.9, 3.3), DOWNWARD, (-0.5, 0.25)),
    "camera": Frame("camera", (5.2, 2.9), DOWNWARD, (0.55, 0.15)),
    "target": Frame("target", (5.3, 0.55), DOWNWARD, (0.6, 0.12)),
}
TO_HAND = {
    "base": Frame("base", (2.9, 0.4), UPRIGHT, (-0.1, -0.32)),
    "gripper": Frame("gripper", (3.6, 3.2), DOWNWARD, (0.05, 0.5)),
    "camera": Frame("camera", (0.3, 2.5), FORWARD, (-0.15, 0.25)),
    "target": Frame("target", (6.2, 2.2), FORWARD, (0.35, 0.17)),
}


def draw(
    frames: dict[str, Frame], arrows: Sequence[tuple[str, str, str, float]], name: str
) -> None:
    """Write the figure of a setup.

    Args:
        frames: The four frames.
        arrows: Frame A, frame B, colour and bend of the arrow for A_T_B, which points to B.
        name: Of the file.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.4), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-0.6, 6.9), ylim=(-0.55, 4.05), aspect="equal")
    axes.axis("off")
    base, gripper = frames["base"].at, frames["gripper"].at
    elbow = (base[0] + 0.15, gripper[1] + 0.25)
    axes.plot(*zip(base, elbow, gripper, strict=True), color=STEEL, lw=11, zorder=0,
              solid_capstyle="round", solid_joinstyle="round")  # fmt: skip
    for start, end, colour, bend in arrows:
        _arrow(axes, frames[start], frames[end], colour, bend)
    for frame in frames.values():
        _frame(axes, frame)
    figure.savefig(FOLDER / name, metadata={"Date": None})


def _frame(axes: Any, frame: Frame) -> None:
    x, y = frame.at
    for letter, colour, (u, v) in zip("xyz", (RED, GREEN, BLUE), frame.axes, strict=True):
        end = (x + ARM * u, y + ARM * v)
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", end, frame.at, arrowprops=arrow, zorder=3)
        away = (x + (ARM + 0.13) * u, y + (ARM + 0.13) * v)
        axes.text(*away, letter, color=colour, ha="center", va="center", fontsize=11)
    axes.plot(x, y, "o", color=INK, ms=5, zorder=4)
    axes.text(x + frame.label[0], y + frame.label[1], frame.name, color=INK, ha="center",
              fontsize=12, fontweight="bold", zorder=4)  # fmt: skip


def _arrow(axes: Any, start: Frame, end: Frame, colour: str, bend: float) -> None:
    """Draw the arrow of `start_T_end`, with its name beside the middle of the bow."""
    style = {"arrowstyle": "-|>", "color": colour, "lw": 1.8, "ls": (0, (4, 2)), "shrinkA": 9,
             "shrinkB": 9, "connectionstyle": f"arc3,rad={bend}"}  # fmt: skip
    axes.annotate("", end.at, start.at, arrowprops=style, zorder=2)
    (ax, ay), (bx, by) = start.at, end.at
    middle = ((ax + bx) / 2 + bend * (by - ay) / 2, (ay + by) / 2 - bend * (bx - ax) / 2)
    axes.text(*middle, f"{start.name}_T_{end.name}", color=colour, ha="center", va="center",
              fontsize=11, family="monospace", zorder=5,
              bbox={"fc": "white", "ec": "none", "pad": 1.5})  # fmt: skip


def frames() -> None:
    """Write the figures of both setups."""
    mpl.rcParams["svg.hashsalt"] = "handeye"
    draw(
        IN_HAND,
        [
            ("base", "gripper", GREY, -0.12),
            ("gripper", "camera", ANSWER, -0.3),
            ("camera", "target", GREY, -0.25),
            ("base", "target", GREY, 0.1),
        ],
        "frames-eye-in-hand.svg",
    )
    draw(
        TO_HAND,
        [
            ("base", "gripper", GREY, 0.3),
            ("gripper", "target", GREY, -0.5),
            ("camera", "target", GREY, 0.04),
            ("base", "camera", ANSWER, -0.15),
        ],
        "frames-eye-to-hand.svg",
    )


def report(browser: str) -> None:
    """Write the picture of the report of the sample recording."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        handeye = [sys.executable, "-m", "handeye_cli", "report", SAMPLE]
        subprocess.run([*handeye, "-q", "-o", str(page)], cwd=ROOT, check=True)
        quietly = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        size = f"--window-size={SCREEN[0]},{SCREEN[1]}"
        picture = f"--screenshot={FOLDER / 'report.png'}"
        profile = f"--user-data-dir={folder}/profile"
        command = [browser, *quietly, profile, size, picture, page.as_uri()]
        subprocess.run(command, check=True, capture_output=True)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["frames"]:
            frames()
        case ["report", browser]:
            report(browser)
        case _:
            sys.exit(__doc__)
