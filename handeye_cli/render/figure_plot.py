"""A figure of the paper as a picture: errors, what predicts them, and the best there can be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from handeye_cli.conventions import MM, MRAD
from handeye_cli.records.simulation import Abscissa, Ordinate, SimulatedFigure, Simulation
from handeye_cli.render.sheet import sheet_png
from handeye_cli.render.text import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (6.4, 4.4)
"""Inches."""
_RMS_COLOUR = "#0072b2"
_CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    "largest error": ("largest", {"color": "0.55", "linestyle": "--", "marker": "."}),
    "paper's formula, RMS": ("predicted", {"color": "#d55e00", "linestyle": "-."}),
    "RMS error": ("rms", {"color": _RMS_COLOUR, "linestyle": "none", "marker": "o"}),
    "Cramer-Rao bound": ("bound", {"color": "#009e73", "linestyle": ":", "linewidth": 2}),
}
"""Label, field of the points, and look of each curve, in colours that all people can tell."""


def figure_png(figure: SimulatedFigure, simulation: Simulation) -> bytes:
    """Return a figure as a PNG; the same bytes for the same figure.

    Args:
        figure: What is drawn.
        simulation: Where it is from, for the title.

    Raises:
        UsageError: Matplotlib is not installed.
    """

    def draw(sheet: Figure) -> None:
        axes = sheet.add_subplot()
        axes.set_title(
            f"Figure {figure.number}: {simulation.setting.method}, "
            f"{count(simulation.trials, 'trial')} per point"
        )
        _draw(axes, figure)

    return sheet_png(_SIZE, draw)


def _draw(axes: Axes, figure: SimulatedFigure) -> None:
    """Draw the errors of all points, and the straight line through their RMS."""
    unit = MRAD if figure.ordinate is Ordinate.ROTATION else MM
    scale = MM if figure.abscissa is Abscissa.DISTANCE else 1.0
    x = np.array([point.abscissa for point in figure.points])
    for label, (name, look) in _CURVES.items():
        y = np.array([getattr(point, name) for point in figure.points])
        axes.plot(x / scale, y / unit, label=label, **look)
    line = figure.line.intercept + figure.line.slope * x
    label = f"line through the RMS, R² = {figure.line.r_squared:.4f}"
    axes.plot(x / scale, line / unit, color=_RMS_COLOUR, linewidth=1, label=label)
    axes.set_xlabel(_label(figure.abscissa, figure.abscissa.unit))
    axes.set_ylabel(_label(figure.ordinate, figure.ordinate.unit))
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", fontsize="small")


def _label(quantity: str, unit: str) -> str:
    return f"{quantity} [{unit}]" if unit else str(quantity)
