"""Simulation documents: the errors of simulated calibrations, or figures of the paper.

Errors are in mrad and mm. One figure stands in the document itself, several are its `figures`.
"""

from __future__ import annotations

import math
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.schema import header
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.records import Noise, PaperPrediction
from handeye_cli.records.simulation import (
    FIGURES,
    Abscissa,
    ErrorBound,
    FigurePoint,
    SimulatedErrors,
    SimulatedFigure,
    Simulation,
    SimulationSetting,
    StraightLine,
)

_DIGITS = 12
"""Decimals of a tilt: 30 deg shall not come out as 29.999999999999996."""
_ERRORS = {
    "rotation_rms": "rotation_rms_mrad",
    "rotation_max": "rotation_max_mrad",
    "translation_rms": "translation_rms_mm",
    "translation_max": "translation_max_mm",
}
_PREDICTED = {
    "rotation": "rotation_mrad",
    "translation": "translation_mm",
    "rotation_max": "rotation_max_mrad",
    "translation_max": "translation_max_mm",
}
_BOUND = {"rotation": "rotation_mrad", "translation": "translation_mm"}
_POINT = {"rms": "rms", "largest": "max", "predicted": "predicted", "bound": "crb"}


def record_from_data(data: dict[str, Any], context: Context) -> Simulation:
    """Return the simulation of a document."""
    figures = data.get("figures", [data] if "figure" in data else [])
    return Simulation(
        setup=context.setup,
        setting=_setting(data),
        trials=int(data["trials"]),
        seed=int(data["seed"]),
        errors=_errors(data) if "crb" in data else None,
        figures=tuple(_figure(entry) for entry in figures),
        diagnosis=parts.findings_from_data(data.get("diagnosis", [])),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def data_from_record(record: Simulation) -> dict[str, Any]:
    """Return the document of a simulation."""
    figures = [_figure_entry(figure) for figure in record.figures]
    return parts.without_unknown(
        {
            "schema": header("simulation"),
            "setup": str(record.setup),
            "method": record.setting.method,
            "trials": record.trials,
            "seed": record.seed,
            "setting": _setting_entry(record.setting),
            "noise": parts.data_from_noise(record.setting.noise),
            **(_errors_entry(record.errors) if record.errors else {}),
            **(figures[0] if len(figures) == 1 else {"figures": figures or None}),
            "diagnosis": parts.data_from_findings(record.diagnosis),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _setting(data: dict[str, Any]) -> SimulationSetting:
    entry = data["setting"]
    return SimulationSetting(
        stations=int(entry["stations"]),
        distance=from_milli(entry["distance_mm"]),
        tilt=math.radians(entry["tilt_deg"]),
        lever=from_milli(entry["lever_mm"]),
        noise=parts.noise_from_data(data["noise"]) or Noise(),
        method=data["method"],
        pairs=entry["pairs"],
    )


def _setting_entry(setting: SimulationSetting) -> dict[str, Any]:
    return {
        "stations": setting.stations,
        "distance_mm": to_milli(setting.distance),
        "tilt_deg": round(math.degrees(setting.tilt), _DIGITS),
        "lever_mm": to_milli(setting.lever),
        "pairs": setting.pairs,
    }


def _errors(data: dict[str, Any]) -> SimulatedErrors:
    return SimulatedErrors(
        **_from_milli(data, _ERRORS),
        predicted=PaperPrediction(**_from_milli(data["predicted"], _PREDICTED)),
        bound=ErrorBound(**_from_milli(data["crb"], _BOUND)),
    )


def _errors_entry(errors: SimulatedErrors) -> dict[str, Any]:
    return {
        **_to_milli(errors, _ERRORS),
        "predicted": _to_milli(errors.predicted, _PREDICTED),
        "crb": _to_milli(errors.bound, _BOUND),
    }


def _figure(entry: dict[str, Any]) -> SimulatedFigure:
    number, line = int(entry["figure"]), entry["line"]
    is_length = FIGURES[number][0] is Abscissa.DISTANCE
    points = tuple(
        FigurePoint(
            abscissa=from_milli(point["abscissa"]) if is_length else float(point["abscissa"]),
            **_from_milli(point, _POINT),
        )
        for point in entry["points"]
    )
    slope = float(line["slope"]) if is_length else from_milli(line["slope"])
    straight = StraightLine(slope, from_milli(line["intercept"]), float(line["r_squared"]))
    return SimulatedFigure(number, points, straight)


def _figure_entry(figure: SimulatedFigure) -> dict[str, Any]:
    is_length, line = figure.abscissa is Abscissa.DISTANCE, figure.line
    points = [
        {
            "abscissa": to_milli(point.abscissa) if is_length else point.abscissa,
            **_to_milli(point, _POINT),
        }
        for point in figure.points
    ]
    return {
        "figure": figure.number,
        "varied": figure.abscissa.varied,
        "abscissa": _axis(figure.abscissa, figure.abscissa.unit),
        "ordinate": _axis(figure.ordinate, figure.ordinate.unit),
        "points": points,
        "line": {
            "slope": line.slope if is_length else to_milli(line.slope),
            "intercept": to_milli(line.intercept),
            "r_squared": line.r_squared,
        },
    }


def _from_milli(data: dict[str, Any], keys: dict[str, str]) -> dict[str, float]:
    return {name: from_milli(data[key]) for name, key in keys.items()}


def _to_milli(record: Any, keys: dict[str, str]) -> dict[str, Any]:
    return {key: to_milli(getattr(record, name)) for name, key in keys.items()}


def _axis(quantity: str, unit: str) -> str:
    return f"{quantity} [{unit}]" if unit else str(quantity)
