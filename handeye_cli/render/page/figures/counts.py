"""Held-out errors against the number of stations calibrated on, with what was expected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from handeye_cli.records import Verification
from handeye_cli.render.page.figures.quantity import Quantity
from handeye_cli.render.page.palette import BLUE, ORANGE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_counts(axes: Axes, verifications: Sequence[Verification], quantity: Quantity) -> None:
    """Draw one error of all rows.

    Args:
        axes: Where to.
        verifications: Each is a line of its own, or a dot when it has one row.
        quantity: Which error.
    """
    from matplotlib.ticker import MaxNLocator

    field, unit = quantity.name, quantity.unit
    for index, each in enumerate(verifications):
        rows = sorted(each.rows, key=lambda row: row.stations)
        x = np.array([row.stations for row in rows])
        seen = np.array([getattr(row, field) for row in rows]) / unit
        expected = np.array([getattr(row, f"predicted_{field}") or np.nan for row in rows]) / unit
        beyond = np.array([row.consistent is False for row in rows])
        names = ("seen", "expected") if index == 0 else (None, None)
        axes.plot(x, expected, "s--", color=ORANGE, markersize=5, alpha=0.9, label=names[1])
        axes.plot(x, seen, "o-", color=BLUE, markersize=5, label=names[0])
        axes.plot(x[beyond], seen[beyond], "o", color=RED, markersize=11, fillstyle="none")
    axes.set_xlabel("stations calibrated on")
    axes.set_ylabel(quantity.label)
    axes.set_ylim(bottom=0.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(loc="best")
