"""A plan as a picture: where the camera goes and how it is turned there, from above and aside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import FloatArray, Plan
from handeye_cli.render.sheet import sheet_png
from handeye_cli.render.text import count, mm, mrad

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.6, 5.0)
"""Inches."""
_PURPOSES: dict[str, tuple[str, dict[str, Any]]] = {
    "calibrate": ("to calibrate on", {"color": "#0072b2"}),
    "verify": ("to verify on", {"color": "#d55e00", "markerfacecolor": "none"}),
}
"""Label and look of the stations, in colours that all people can tell."""
_AXES: dict[str, dict[str, Any]] = {
    "line of sight": {"color": "0.45"},
    "right in the image": {"color": "#cc79a7"},
}
"""Label and look of the camera's z axis and of its x axis."""
_SIGHT, _RIGHT = 0.4, 0.2
"""Lengths of the camera's axes in units of its median distance from the target's origin."""
_FEW = 30
"""Stations whose names do not yet cover each other."""


def plan_png(plan: Plan) -> bytes:
    """Return a plan as a PNG; the same bytes for the same plan.

    Args:
        plan: The stations; those of a plan with an order are joined by a line.

    Raises:
        UsageError: Matplotlib is not installed.
    """

    def draw(sheet: Figure) -> None:
        sheet.suptitle(_title(plan))
        above, aside = sheet.subplots(1, 2)
        _draw(above, plan, 1)
        above.set(title="From above, as a camera sees the target", ylabel="y [mm]")
        above.invert_yaxis()
        _draw(aside, plan, 2)
        aside.set(title="From the side", ylabel="height above the target [mm]")
        aside.axhline(0.0, color="0.6", linewidth=1)
        sheet.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=5)

    return sheet_png(_SIZE, draw)


def _title(plan: Plan) -> str:
    used = [station for station in plan.stations if station.purpose == "calibrate"]
    stations = f"{count(len(used), 'station')} to calibrate on"
    error = plan.predicted_error
    if error is None:
        return stations
    return f"{stations}; expected error {mrad(error.rotation)} mrad, {mm(error.translation)} mm"


def _draw(axes: Axes, plan: Plan, across: int) -> None:
    """Draw the stations in the plane of the target's x and another of its axes, millimetres."""
    cameras = np.stack([station.target_T_camera for station in plan.stations])
    # the target's z points away from the cameras, and height towards them
    flat = cameras[:, [0, across]] * np.array([1.0, -1.0 if across == 2 else 1.0])[:, None] / MM
    places = flat[:, :, 3]
    size = float(np.median(np.linalg.norm(cameras[:, :3, 3], axis=1))) / MM
    _draw_way(axes, plan, places)
    for (label, look), column, part in zip(_AXES.items(), (2, 0), (_SIGHT, _RIGHT), strict=True):
        ends = places + part * size * MM * flat[:, :, column]
        lines = np.stack([places, ends, np.full_like(places, np.nan)], axis=1).reshape(-1, 2)
        axes.plot(*lines.T, label=label, zorder=1, **look)
    for purpose, (label, look) in _PURPOSES.items():
        chosen = np.array([station.purpose == purpose for station in plan.stations])
        if np.any(chosen):
            x, y = places[chosen].T
            axes.plot(x, y, linestyle="none", marker="o", label=label, **look)
    for station, place in zip(plan.stations if len(places) <= _FEW else (), places, strict=False):
        axes.annotate(station.name, place, (5, 5), textcoords="offset points", fontsize="small")
    axes.plot(0.0, 0.0, marker="s", color="0.6", linestyle="none", label="target's origin")
    axes.margins(0.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    axes.grid(alpha=0.3)


def _draw_way(axes: Axes, plan: Plan, places: FloatArray) -> None:
    names = [station.name for station in plan.stations]
    x, y = places[[names.index(name) for name in plan.order]].T if plan.order else ([], [])
    axes.plot(x, y, color="0.8", linewidth=1, zorder=0)
