"""The table of stations in reports: which were used, and how far each is from the others."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from handeye_cli.records import StationResidual
from handeye_cli.render.console import show_table
from handeye_cli.render.text import mm, mrad


def show_residuals(stations: Sequence[StationResidual], console: Console) -> None:
    """Print a row for every station."""
    rows = [
        [
            station.name,
            "yes" if station.used else "no",
            mrad(station.rotation),
            mm(station.translation),
            station.reason or "",
        ]
        for station in stations
    ]
    headings = ["station", "used", "rotation\nmrad", "translation\nmm", ""]
    show_table(console, headings, rows, left=[0, 1, 4])
