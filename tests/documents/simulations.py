"""Simulations with a value in every field, for the tests of their documents and reports."""

from __future__ import annotations

import math

from documents import samples

from handeye_cli.conventions import Setup
from handeye_cli.records import Noise, PaperPrediction
from handeye_cli.records.simulation import (
    ErrorBound,
    FigurePoint,
    SimulatedErrors,
    SimulatedFigure,
    Simulation,
    SimulationSetting,
    StraightLine,
)

SETTING = SimulationSetting(
    3, 0.16891, math.radians(30), 0.2413, Noise(1.5e-3, 1.27e-4, 1 / 3000, 7.62e-5), "shah", "all"
)
ERRORS = SimulatedErrors(
    3.15e-3, 1 / 300, 6.88e-4, 2**0.5 / 1000,
    PaperPrediction(4.4e-3, 1.3e-3, 0.02, 0.025), ErrorBound(2.78e-3, 5.7e-4),
)  # fmt: skip
POINTS = (FigurePoint(1 / 3, 3e-3, 9e-3, 4e-3, 2.5e-3), FigurePoint(0.5, 4e-3, 0.1, 5e-3, 1e-300))
FIGURES = tuple(
    SimulatedFigure(number, POINTS, StraightLine(6e-3, -1e-3, 1 / 3)) for number in range(8, 14)
)
BASE = Simulation(
    Setup.EYE_IN_HAND, SETTING, 1000, 7,
    diagnosis=samples.FINDINGS, provenance=samples.PROVENANCE,
)  # fmt: skip
