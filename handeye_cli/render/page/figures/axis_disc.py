"""The axes of rotations between stations, on a disc that shows all directions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from handeye_cli.render.page.palette import BLUE, FAINT, GRID, ORANGE
from handeye_cli.reporting.axis_coverage import AxisCoverage, on_disc

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LARGEST = 60.0
"""Area of the dot of the largest rotation, square points."""


def draw_axes(axes: Axes, coverage: AxisCoverage) -> None:
    """Draw axes as dots; those of the answer's own pairs stand out."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(-1.2, 1.2)
    axes.set_ylim(-1.15, 1.15)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    for tilt in np.radians([30.0, 60.0, 90.0]):
        ring = np.stack(
            [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt) + 0.0 * turn],
            axis=1,
        )
        edge = tilt > 1.5
        x, y = on_disc(np.maximum(ring, [-1.0, -1.0, 0.0])).T
        axes.plot(x, y, color=FAINT if edge else GRID, linewidth=1.0 if edge else 0.8)
    for place, name in (((1.04, 0.0), "x"), ((0.0, 1.04), "y"), ((0.02, 0.02), "z")):
        axes.annotate(name, place, color=FAINT, va="bottom" if name != "x" else "center")
    area = _LARGEST * coverage.angles / max(float(coverage.angles.max(initial=0.0)), 1e-9)
    for chosen, colour, label in (
        (False, BLUE, "any two stations"),
        (True, ORANGE, "pairs of the answer"),
    ):
        rows = coverage.chosen == chosen
        if np.any(rows):
            x, y = coverage.places[rows].T
            axes.scatter(
                x, y, s=area[rows], color=colour, alpha=0.85 if chosen else 0.35,
                linewidths=0.0, label=label,
            )  # fmt: skip
    axes.legend(loc="lower left", bbox_to_anchor=(-0.05, -0.05))
