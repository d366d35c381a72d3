"""Residuals of stations as bars, with their errors when they are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from handeye_cli.records import StationError, StationResidual
from handeye_cli.render.page.drawing import short
from handeye_cli.render.page.figures.quantity import Quantity
from handeye_cli.render.page.palette import BLUE, FAINT, ORANGE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_NAMES = 40
"""Stations whose names fit below an axis."""


def draw_bars(
    axes: Axes,
    stations: Sequence[StationResidual],
    left_out: Mapping[str, StationError],
    quantity: Quantity,
) -> None:
    """Draw one residual of every station.

    Args:
        axes: Where to.
        stations: In the order of the document.
        left_out: Errors of stations that took no part, by name; they may be missing.
        quantity: Which residual.
    """
    field, unit = quantity.name, quantity.unit
    values = np.array([getattr(each, field) or 0.0 for each in stations]) / unit
    place = np.arange(len(stations))
    axes.bar(place, values, color=BLUE, alpha=0.8, width=0.7)
    unused = np.array([not each.used for each in stations])
    if np.any(unused):
        axes.plot(place[unused], values[unused], "x", color=RED, markersize=7, clip_on=False)
    dots = [(k, getattr(left_out[each.name], field) / unit) for k, each in enumerate(stations)
            if each.name in left_out]  # fmt: skip
    if dots:
        x, y = np.array(dots).T
        axes.plot(x, y, "o", color=ORANGE, markersize=4)
    axes.set_ylabel(quantity.label)
    axes.set_ylim(bottom=0.0)
    axes.grid(visible=False, axis="x")
    shown = place[:: max(1, -(-len(place) // _MOST_NAMES))]
    axes.set_xticks(shown, [short(stations[k].name) for k in shown])
    axes.tick_params(axis="x", length=0.0, labelrotation=_rotation(stations), labelcolor=FAINT)


def _rotation(stations: Sequence[StationResidual]) -> float:
    signs = sum(len(short(each.name)) + 1 for each in stations)
    return 90.0 if signs > 70 else 0.0
