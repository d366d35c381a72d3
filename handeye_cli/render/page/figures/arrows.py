"""Mean residuals as magnified arrows, over the image and over the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import FloatArray
from handeye_cli.render.page.palette import BLUE, FAINT
from handeye_cli.reporting.pixel_residuals import PixelResiduals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_REACH = 0.07
"""Length of the longest arrow over the width of what is shown."""
_MOST_DOTS = 2000
"""Dots that are drawn as shapes; more of them become pixels."""


def draw_image_arrows(axes: Axes, residuals: PixelResiduals) -> None:
    """Draw the means over cells of the image, and where points were seen."""
    width, height = residuals.size
    x, y = residuals.pixels.T
    axes.plot(
        x, y, ".", color=FAINT, markersize=2.5, alpha=0.6, markeredgewidth=0.0,
        rasterized=len(x) > _MOST_DOTS,
    )  # fmt: skip
    _arrows(axes, residuals.image.places, residuals.image.means, width, "px")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    _frame(axes, "px")


def draw_plate_arrows(axes: Axes, residuals: PixelResiduals) -> None:
    """Draw the means at the points of the plate, as seen from its front."""
    places, means = residuals.plate.places / MM, residuals.plate.means / MM
    low, high = places.min(axis=0), places.max(axis=0)
    extent = float(np.max(high - low)) or 1.0
    axes.plot(*places.T, ".", color=FAINT, markersize=4)
    _arrows(axes, places, means, extent, "mm")
    margin = 0.12 * extent
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(high[1] + margin, low[1] - margin)
    _frame(axes, "mm")


def _arrows(axes: Axes, places: FloatArray, means: FloatArray, extent: float, unit: str) -> None:
    longest = float(np.max(np.linalg.norm(means, axis=1), initial=0.0))
    magnified = _REACH * extent / max(longest, 1e-12)
    drawn = axes.quiver(
        *places.T, *means.T, angles="xy", scale_units="xy", scale=1.0 / magnified, clip_on=False,
        color=BLUE, width=0.005, headwidth=3.5, headlength=4.0, headaxislength=3.6,
    )  # fmt: skip
    # what is not clipped asks for room, and arrows ask for far too much of it
    drawn.set_in_layout(False)
    axes.set_title(f"longest arrow: {longest:.2g} {unit}", loc="right", fontsize=8)


def _frame(axes: Axes, unit: str) -> None:
    axes.set_aspect("equal")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"y [{unit}]")
