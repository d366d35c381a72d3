"""The paper's figures 8 to 13: errors while one critical factor varies and the others stay.

A sweep is a list of layouts with their abscissae; figures that share one show the same trials.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry.station_generator import (
    angles_between_axes,
    generate_stations,
    interstation_angles,
)
from handeye_cli.records import FloatArray
from handeye_cli.records.simulation import (
    FIGURES,
    Abscissa,
    FigurePoint,
    Ordinate,
    SimulatedErrors,
    SimulatedFigure,
    Simulation,
    SimulationSetting,
    StraightLine,
)
from handeye_cli.simulate.setting import Layout, check, layout_of
from handeye_cli.simulate.trials import critical_factors, run_trials

Sweep = Iterator[tuple[float, Layout]]
"""Abscissae and layouts."""

_INVERSE_ANGLES = np.linspace(1.0, 5.0, 9)
"""1/rad: interstation angles of 57 to 11 degrees."""
_GENERATED = range(3, 21, 2)
"""Stations of the circles that three neighbours of the star are taken from."""
_DISTANCES = np.linspace(0.02, 0.34, 9)
"""Metres, up to twice the paper's."""
_COUNTS = (41, 31, 21, 15, 11, 9, 7, 5, 3)
"""Numbers of stations, all odd as in the paper."""


def simulate_figures(
    numbers: Sequence[int], setting: SimulationSetting, trials: int, seed: int
) -> Simulation:
    """Simulate figures of the paper around a setting.

    Args:
        numbers: Of the figures, 8 to 13.
        setting: All that a figure does not vary.
        trials: Calibrations in each point.
        seed: Of all chance. Points do not share their chance, figures of one sweep do.

    Raises:
        UsageError: There is no such figure, a number is out of its range, or a method or a choice
            of pairs unknown.
        ConvergenceError: The method did not settle in every trial.
    """
    for number in numbers:
        if number not in FIGURES:
            raise UsageError(
                f"expected a figure of {min(FIGURES)} to {max(FIGURES)}, found {number}",
                hint="the other figures of the paper show no simulations",
            )
    check(setting, trials, seed)
    wanted = {FIGURES[number][0]: None for number in numbers}
    swept = {abscissa: _swept(abscissa, setting, trials, seed) for abscissa in wanted}
    figures = tuple(_figure(number, swept[FIGURES[number][0]]) for number in numbers)
    return Simulation(Setup.EYE_IN_HAND, setting, trials, seed, figures=figures)


def sweep(abscissa: Abscissa, setting: SimulationSetting) -> Sweep:
    """Yield abscissae, rising, and layouts in which one factor varies.

    Args:
        abscissa: The factor.
        setting: All that stays.
    """
    return _SWEEPS[abscissa](setting)


def straight_line(x: FloatArray, y: FloatArray) -> StraightLine:
    """Return the line through (n,) points with the least squares along y."""
    slope, intercept = np.polyfit(x, y, 1).tolist()
    total = float(np.sum((y - np.mean(y)) ** 2))
    left = float(np.sum((y - intercept - slope * x) ** 2))
    return StraightLine(slope, intercept, 1.0 - left / total if total > 0.0 else 1.0)


def _swept(
    abscissa: Abscissa, setting: SimulationSetting, trials: int, seed: int
) -> list[tuple[float, SimulatedErrors]]:
    points = list(sweep(abscissa, setting))
    seeds = np.random.SeedSequence(seed).spawn(len(points))
    return [
        (x, run_trials(layout, setting, trials, np.random.default_rng(own)))
        for (x, layout), own in zip(points, seeds, strict=True)
    ]


def _figure(number: int, swept: list[tuple[float, SimulatedErrors]]) -> SimulatedFigure:
    show = _rotation if FIGURES[number][1] is Ordinate.ROTATION else _translation
    points = tuple(show(x, errors) for x, errors in swept)
    x, rms = np.array([(point.abscissa, point.rms) for point in points]).T
    return SimulatedFigure(number, points, straight_line(x, rms))


def _rotation(x: float, e: SimulatedErrors) -> FigurePoint:
    return FigurePoint(x, e.rotation_rms, e.rotation_max, e.predicted.rotation, e.bound.rotation)


def _translation(x: float, e: SimulatedErrors) -> FigurePoint:
    return FigurePoint(
        x, e.translation_rms, e.translation_max, e.predicted.translation, e.bound.translation
    )


def _by_angle(setting: SimulationSetting) -> Sweep:
    """Vary the tilt; where pairs differ in their angles, the abscissa is that of the RMS angle."""
    for inverse in _INVERSE_ANGLES:
        tilt = _tilt_of(1.0 / inverse, setting.stations)
        layout = layout_of(replace(setting, tilt=tilt))
        yield 1.0 / critical_factors(layout, setting.lever).angle, layout


def _by_axes(setting: SimulationSetting) -> Sweep:
    """Take the first three stations of ever larger stars, as the paper does.

    The more stations a circle has, the nearer to each other are the axes of successive steps. The
    tilt keeps the angle of a step at that of three stations.
    """
    layout = layout_of(replace(setting, stations=3))
    angle = float(interstation_angles(layout.target_T_camera, [(0, 1)])[0])
    for count in _GENERATED:
        around = generate_stations(count, setting.distance, _tilt_of(angle, count))
        cameras = around[np.arange(3) * ((count - 1) // 2) % count]
        between = angles_between_axes(cameras, [(0, 1), (1, 2)])[0, 1]
        yield 1.0 / float(np.sin(between)), Layout(cameras, layout.pairs)


def _by_distance(setting: SimulationSetting) -> Sweep:
    for distance in _DISTANCES.tolist():
        yield distance, layout_of(replace(setting, distance=distance))


def _by_pairs(setting: SimulationSetting) -> Sweep:
    for count in _COUNTS:
        layout = layout_of(replace(setting, stations=count))
        yield len(layout.pairs) ** -0.5, layout


def _tilt_of(angle: float, count: int) -> float:
    """Return the tilt with which a step of the star turns the camera by an angle, in radians."""
    step = np.pi * ((count - 1) // 2) / count
    return 2.0 * float(np.arcsin(np.sin(angle / 4.0) / np.sin(step)))


_SWEEPS: dict[Abscissa, Callable[[SimulationSetting], Sweep]] = {
    Abscissa.ANGLE: _by_angle,
    Abscissa.AXES: _by_axes,
    Abscissa.DISTANCE: _by_distance,
    Abscissa.PAIRS: _by_pairs,
}
