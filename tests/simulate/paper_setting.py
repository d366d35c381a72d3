"""The base setting of the paper's simulations, section IV-A2."""

from __future__ import annotations

import math

from handeye_cli.conventions import MIL
from handeye_cli.records import Noise
from handeye_cli.records.simulation import SimulationSetting

NOISE = Noise(1.5e-3, 5 * MIL, 1.5e-3, 3 * MIL)
PAPER = SimulationSetting(
    3, 6.65 * 0.0254, math.radians(30), 9.5 * 0.0254, NOISE, "tsai-lenz", "star"
)
