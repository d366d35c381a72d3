"""Stage: what is right and what is wrong with the data, before or instead of an answer."""

from __future__ import annotations

from dataclasses import replace

from handeye_cli.chain import chain_of
from handeye_cli.diagnosis.blame import blame
from handeye_cli.diagnosis.pixel_noise import unexplained_pixel_noise
from handeye_cli.diagnosis.undetermined import free_directions, named
from handeye_cli.errors import ConvergenceError, UndeterminedError
from handeye_cli.examination import Examined, examine
from handeye_cli.records import Finding, Inspection, StationResidual, Stations
from handeye_cli.records.basics import GRAVITY
from handeye_cli.solve import answer
from handeye_cli.time_offset import Measured


def inspect(stations: Stations, detector_sigma: float | None = None) -> Inspection:
    """Look for everything that can be wrong with the stations of a document.

    Args:
        stations: Robot and target poses; what cannot be solved is told, not refused.
        detector_sigma: Standard deviation of a coordinate in the images as the detector has it,
            pixels, where that is known.
    """
    looked = Inspection(stations.setup, _unused(stations), stations.findings)
    try:
        everybody = chain_of(stations, fewest=1)
    except UndeterminedError as error:
        return _with(looked, _as_finding(error, "no-stations"))
    examined = examine(stations, everybody, thorough=True)
    looked = replace(
        looked,
        stations=_rows(stations, examined),
        hypotheses=examined.verdict.hypotheses,
        length_ratio=examined.verdict.scale,
    )
    if examined.errors:
        return _with(looked, *examined.findings)
    try:
        found = answer(stations, examined=examined)
    except UndeterminedError as error:
        free = named(free_directions(examined.chain, stations.noise), stations.setup)
        looked = _with(looked, *examined.findings, _as_finding(error, "not-determined"))
        return replace(looked, free=free)
    except ConvergenceError as error:
        return _with(looked, *examined.findings, _as_finding(error, "not-converged"))
    calibration, shape = found.calibration, examined.shape
    shares = blame(found.estimate, stations, examined.chain, shape)
    noisy = unexplained_pixel_noise(shape, detector_sigma) if shape else None
    looked = replace(
        looked,
        stations=calibration.stations,
        diagnosis=calibration.diagnosis,
        predicted_error=calibration.predicted_error,
        surfaces=shape.seen if shape else None,
        blame=shares,
    )
    return _with(looked, *((noisy,) if noisy else ()))


def with_time_offset(looked: Inspection, measured: Measured) -> Inspection:
    """Return an inspection with the time between images and poses.

    Args:
        looked: What was found at the stations.
        measured: What frames in motion say of the time; its finding may be among them already.
    """
    told = () if measured.finding in looked.diagnosis else (measured.finding,)
    return _with(replace(looked, time_offset=measured.offset), *told)


def _unused(stations: Stations) -> tuple[StationResidual, ...]:
    return tuple(
        StationResidual(each.name, each.camera_T_target is not None, reason=each.reason)
        for each in stations.stations
    )


def _rows(stations: Stations, examined: Examined) -> tuple[StationResidual, ...]:
    return tuple(
        replace(row, used=False, reason=examined.reasons[i]) if i in examined.reasons else row
        for i, row in enumerate(_unused(stations))
    )


def _as_finding(error: UndeterminedError | ConvergenceError, code: str) -> Finding:
    return Finding(code, "error", error.message, error.hint or "")


def _with(looked: Inspection, *findings: Finding) -> Inspection:
    """Return an inspection with more findings, the gravest of all first."""
    together = (*looked.diagnosis, *findings)
    ordered = sorted(together, key=lambda each: GRAVITY.index(each.severity))
    return replace(looked, diagnosis=tuple(ordered))
