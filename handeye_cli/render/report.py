"""The report of any record of the line."""

from __future__ import annotations

from typing import Any

from rich.console import Console

from handeye_cli.records import (
    Calibration,
    Features,
    Inspection,
    Plan,
    Simulation,
    Stations,
    Verification,
)
from handeye_cli.records.batch import Batch
from handeye_cli.render.batch import show_batch
from handeye_cli.render.calibration import show_calibration
from handeye_cli.render.inspection import show_inspection
from handeye_cli.render.plan import show_plan
from handeye_cli.render.simulation import show_simulation
from handeye_cli.render.stations import show_features, show_stations
from handeye_cli.render.verification import show_verification

_REPORTS: dict[type, Any] = {
    Features: show_features,
    Stations: show_stations,
    Calibration: show_calibration,
    Verification: show_verification,
    Inspection: show_inspection,
    Plan: show_plan,
    Simulation: show_simulation,
    Batch: show_batch,
}


def show(record: Any, console: Console) -> None:
    """Print the report of a record; its findings are not part of it."""
    _REPORTS[type(record)](record, console)
