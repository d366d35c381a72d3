"""The settings of the paper's simulation, section IV-A: what can be simulated, and its stations."""

from __future__ import annotations

import math
from dataclasses import dataclass

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS
from handeye_cli.errors import UsageError
from handeye_cli.estimation import choose_pairs
from handeye_cli.geometry.error_formulas import StationNoise
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import FloatArray, IntArray, Noise
from handeye_cli.records.simulation import SimulationSetting

MOST_TRIALS = 100_000
MOST_STATIONS = 1_000
"""All pairs of many more would not fit into memory."""
_FARTHEST = 100.0
"""Metres; a longer distance is a slip of the hand."""
_STEEPEST = math.radians(80.0)
"""Beyond it the plate is seen edge on."""
_LOUDEST = 0.5
"""Radians and metres; errors of first order mean nothing long before."""


@dataclass(frozen=True)
class Layout:
    """Where the camera goes.

    Attributes:
        target_T_camera: (N, 4, 4) true places of the camera.
        pairs: (m, 2) the interstation pairs.
    """

    target_T_camera: FloatArray
    pairs: IntArray


def layout_of(setting: SimulationSetting) -> Layout:
    """Return the stations of the paper's circle, and their pairs.

    Raises:
        UsageError: The choice of pairs is unknown.
    """
    cameras = generate_stations(setting.stations, setting.distance, setting.tilt)
    return Layout(cameras, choose_pairs(setting.pairs, setting.stations))


def station_noise(noise: Noise) -> StationNoise:
    """Return the levels of a setting, None as 0."""
    return StationNoise(
        robot_rotation=noise.robot_rotation or 0.0,
        robot_translation=noise.robot_translation or 0.0,
        camera_rotation=noise.camera_rotation or 0.0,
        camera_translation=noise.camera_translation or 0.0,
    )


def check(setting: SimulationSetting, trials: int, seed: int) -> None:
    """Refuse what cannot be simulated, before any work is done for it.

    Raises:
        UsageError: A number is out of its range, or a method or a choice of pairs unknown.
    """
    _check_counts(setting.stations, trials, seed)
    for name, length in (("distance", setting.distance), ("lever", setting.lever)):
        _check_quantity(name, length, _FARTHEST, "m", f"--{name} 170mm")
    if not 0.0 < setting.tilt <= _STEEPEST:
        raise UsageError(
            f"expected a tilt above 0 and up to {math.degrees(_STEEPEST):g} deg, found "
            f"{math.degrees(setting.tilt):g} deg",
            hint="stations that are not tilted do not differ in rotation",
        )
    for name, level in vars(station_noise(setting.noise)).items():
        flag = name.replace("_", "-")
        unit, example = ("rad", "1.5mrad") if name.endswith("rotation") else ("m", "0.1mm")
        _check_quantity(f"{flag} noise", level, _LOUDEST, unit, f"--{flag} {example}")
    solvers.load(setting.method)
    choose_pairs(setting.pairs, setting.stations)


def _check_counts(stations: int, trials: int, seed: int) -> None:
    if not 1 <= trials <= MOST_TRIALS:
        raise UsageError(
            f"expected 1 to {MOST_TRIALS} trials, found {trials}",
            hint="1000, as in the paper, tell an RMS to some 2 %",
        )
    if seed < 0:
        raise UsageError(f"expected a seed of at least 0, found {seed}")
    if not MIN_STATIONS <= stations <= MOST_STATIONS:
        raise UsageError(
            f"expected {MIN_STATIONS} to {MOST_STATIONS} stations, found {stations}",
            hint="two stations leave the answer undetermined (the paper's lemmas VII and IX)",
        )


def _check_quantity(name: str, value: float, most: float, unit: str, example: str) -> None:
    if not 0.0 <= value <= most:
        raise UsageError(
            f"expected a {name} of 0 to {most:g} {unit}, found {value:g} {unit}",
            hint=f"write it with its unit, such as {example}",
        )
