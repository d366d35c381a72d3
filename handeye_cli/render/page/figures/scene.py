"""Stations in space, as in the paper's figure 6."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from handeye_cli.conventions import MM
from handeye_cli.records import FloatArray
from handeye_cli.render.page.drawing import short
from handeye_cli.render.page.palette import BLUE, FAINT, GREEN, INK, ORANGE, RED
from handeye_cli.reporting.scene import Scene

_MOST_NAMES = 30
"""Stations whose names are written beside them."""
_CLEAR = (1.0, 1.0, 1.0, 0.0)
_GAP = "\N{NO-BREAK SPACE}"
"""Before a name, so that it does not lie on what it names."""


def draw_scene(axes: Any, scene: Scene) -> None:
    """Draw a scene on three-dimensional axes, in mm.

    Args:
        axes: Axes with the projection `3d`.
        scene: What is drawn.
    """
    _frame(axes, scene)
    _plates(axes, scene)
    _lines(axes, scene.pairs / MM, color=ORANGE, linewidth=2.2, alpha=0.75)
    _lines(axes, scene.grippers.reshape(-1, 2, 3) / MM, color=FAINT, linewidth=0.8)
    for rows, colour in _by_use(len(scene.cameras), scene, BLUE):
        ends = scene.cameras[rows].reshape(-1, 2, 3) / MM
        _lines(axes, ends, color=colour, linewidth=1.2)
    for direction, colour in enumerate((RED, GREEN, BLUE)):
        _lines(axes, scene.base[:, direction] / MM, color=colour, linewidth=2.0)
    for place in scene.base[:, 0, 0] / MM:
        axes.text(*place, f"{_GAP}base", fontsize=8, color=INK, va="top")
    if len(scene.names) <= _MOST_NAMES:
        for place, name in zip(scene.places / MM, scene.names, strict=True):
            axes.text(*place, f"{_GAP}{short(name)}", fontsize=7, color=INK)


def _frame(axes: Any, scene: Scene) -> None:
    low, high = scene.low / MM, scene.high / MM
    # the target's z axis points into the plate: turned about x, the cameras are above it
    limits = [(low, high)] * 3 if scene.frame == "base" else [(low, high), (high, low), (high, low)]
    for k, name in enumerate("xyz"):
        first, last = limits[k]
        getattr(axes, f"set_{name}lim")(first[k], last[k])
        axis = getattr(axes, f"{name}axis")
        axis.set_pane_color(_CLEAR)
        axis.set_major_locator(_few())
        axis.label.set_text(f"{name} [mm]")
    axes.set_box_aspect(high - low, zoom=1.0)
    axes.tick_params(labelsize=7, pad=-1)
    axes.view_init(elev=24.0, azim=scene.azimuth)


def _few() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(4)


def _by_use(count: int, scene: Scene, colour: str) -> list[tuple[NDArray[np.bool_], str]]:
    """Return rows of things with their colours; what moves is red where it was not used."""
    moves = count == len(scene.names)
    used = scene.used if moves else np.ones(count, dtype=bool)
    return [(used, colour), (~used, RED)]


def _plates(axes: Any, scene: Scene) -> None:
    if len(scene.plates) == 1:  # many would hide each other, and everything behind them
        sheet = scene.plates[0][[[0, 1], [3, 2]]] / MM
        axes.plot_surface(*np.moveaxis(sheet, -1, 0), color=GREEN, alpha=0.35, shade=False)
    for rows, colour in _by_use(len(scene.plates), scene, GREEN):
        plates = scene.plates[rows]
        edges = np.stack([plates, np.roll(plates, -1, axis=1)], axis=2)
        _lines(axes, edges.reshape(-1, 2, 3) / MM, color=colour, linewidth=0.9)


def _lines(axes: Any, ends: FloatArray, **look: Any) -> None:
    """Draw (n, 2, 3) lines as one with gaps, which takes less of the page."""
    if len(ends):
        gaps = np.full((len(ends), 1, 3), np.nan)
        axes.plot(*np.concatenate([ends, gaps], axis=1).reshape(-1, 3).T, **look)
