"""The report of a simulation: errors beside what predicts them, or figures as tables."""

from __future__ import annotations

from rich.console import Console

from handeye_cli.records.simulation import (
    Abscissa,
    FigurePoint,
    SimulatedErrors,
    SimulatedFigure,
    Simulation,
    SimulationSetting,
)
from handeye_cli.render.console import show_table
from handeye_cli.render.text import count, deg, mil, mm, mrad


def show_simulation(simulation: Simulation, console: Console) -> None:
    """Print what was simulated, then the errors of the setting or the points of its figures."""
    setting, where = simulation.setting, " in each point" if simulation.figures else ""
    console.print(
        f"{count(simulation.trials, 'simulated calibration')}{where} "
        f"({setting.method}, seed {simulation.seed})",
        style="bold",
    )
    _show_setting(setting, console)
    if simulation.errors is not None:
        _show_errors(simulation.errors, console)
    for figure in simulation.figures:
        _show_figure(figure, console)


def _show_setting(setting: SimulationSetting, console: Console) -> None:
    noise = setting.noise
    console.print(
        f"{count(setting.stations, 'station')} tilted by {deg(setting.tilt)} deg, "
        f"{mm(setting.distance)} mm from the target, pairs: {setting.pairs}"
    )
    console.print(f"Gripper to camera {mm(setting.lever)} mm, in any direction")
    console.print(
        f"Noise, RMS: robot {mrad(noise.robot_rotation)} mrad and {mm(noise.robot_translation)} "
        f"mm, camera {mrad(noise.camera_rotation)} mrad and {mm(noise.camera_translation)} mm\n"
    )


def _show_errors(errors: SimulatedErrors, console: Console) -> None:
    paper, bound = errors.predicted, errors.bound
    rows = [
        _row("RMS", errors.rotation_rms, errors.translation_rms),
        _row("largest", errors.rotation_max, errors.translation_max),
        _row("paper's formulas, RMS", paper.rotation, paper.translation),
        _row("paper's formulas, largest", paper.rotation_max, paper.translation_max),
        _row("Cramer-Rao bound, RMS", bound.rotation, bound.translation),
    ]
    show_table(console, ["", "rotation\nmrad", "translation\nmm", "\nmil"], rows, left=[0])


def _row(name: str, rotation: float, translation: float) -> list[str]:
    return [name, mrad(rotation), mm(translation), mil(translation)]


def _show_figure(figure: SimulatedFigure, console: Console) -> None:
    unit = figure.ordinate.unit
    console.print(f"Figure {figure.number}: {figure.ordinate} in {unit}", style="bold")
    console.print(f"against {figure.abscissa}; varied: {figure.abscissa.varied}\n")
    headings = [f"abscissa\n{figure.abscissa.unit}", "RMS", "largest", "paper", "bound"]
    rows = [[_abscissa(point, figure), *_errors_of(point)] for point in figure.points]
    show_table(console, headings, rows, left=[])
    console.print(
        f"  Line through the RMS: {_slope(figure)}, {mrad(figure.line.intercept)} {unit} at 0; "
        f"R2 {figure.line.r_squared:.4f}\n",
        soft_wrap=True,
    )


def _abscissa(point: FigurePoint, figure: SimulatedFigure) -> str:
    return mm(point.abscissa) if figure.abscissa is Abscissa.DISTANCE else f"{point.abscissa:.3f}"


def _errors_of(point: FigurePoint) -> list[str]:
    # mrad of radians and mm of metres are the same digits
    return [mrad(each) for each in (point.rms, point.largest, point.predicted, point.bound)]


def _slope(figure: SimulatedFigure) -> str:
    if figure.abscissa is Abscissa.DISTANCE:
        return f"{figure.line.slope:.5f} mm per mm"
    return f"{mrad(figure.line.slope)} {figure.ordinate.unit} per unit"
