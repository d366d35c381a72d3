"""Plan: where to send the robot."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import Finding, FloatArray, Noise, ProvenanceStep
from handeye_cli.records.planning import CircleError, Gain, MovedStation, PlanBasis
from handeye_cli.records.results import PredictedError


@dataclass(frozen=True)
class PlannedStation:
    """A station to go to.

    Attributes:
        name: Name of the station.
        target_T_camera: (4, 4) pose of the camera in the target.
        base_T_gripper: (4, 4) pose for the robot, when a guess of the calibration is known.
        purpose: `calibrate` or `verify`.
    """

    name: str
    target_T_camera: FloatArray
    base_T_gripper: FloatArray | None = None
    purpose: str = "calibrate"


@dataclass(frozen=True)
class Plan:
    """Stations to visit, and the pairs the closed form will use.

    Attributes:
        setup: Where the camera is fixed.
        stations: Where to go, those to calibrate with first.
        pairs: Interstation pairs (i, j) by index into `stations`.
        predicted_error: Expected error of a calibration on these stations, and on those that were
            recorded already where it adds to them.
        noise: The levels the prediction rests on.
        basis: Where they come from.
        circle: The paper's layout, where the stations are others, to compare with.
        moved: Stations that could not stay where that layout has them.
        gains: What each station adds to those that were recorded already.
        order: Names of all stations in the order of the shortest way, where that was asked for.
        diagnosis: Findings about what it rests on.
        provenance: How it came about.
    """

    setup: Setup
    stations: tuple[PlannedStation, ...]
    pairs: tuple[tuple[int, int], ...]
    predicted_error: PredictedError | None = None
    noise: Noise | None = None
    diagnosis: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
    basis: PlanBasis | None = None
    circle: CircleError | None = None
    moved: tuple[MovedStation, ...] = ()
    gains: tuple[Gain, ...] = ()
    order: tuple[str, ...] = ()
