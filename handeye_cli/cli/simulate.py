"""`handeye simulate`: the paper's simulations, with any method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from handeye_cli.cli.grouping import given
from handeye_cli.cli.options import Output
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.plot_files import check_plot
from handeye_cli.cli.simulate_options import Experiment, NoiseLevels, Plot, Study
from handeye_cli.conventions import parse_angle, parse_length
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.records.simulation import Simulation, SimulationSetting

EXAMPLES = (
    "handeye simulate --figure 12 --plot figure-12.png -o figure-12.yaml",
    "handeye simulate --stations 12 --distance 0.4m \\\n"
    "      --method maximum-likelihood --robot-rotation 0.3mrad --seed 1",
)
_ALL = "all"


def simulate(
    *, experiment: Experiment, levels: NoiseLevels, study: Study, output: Output, plot: Plot
) -> None:
    """Calibrate simulated stations again and again, and count how far off the answers are.

    The stations lie on the paper's circle, tilted views of the target. Beside the errors stand what
    the paper's formulas predict and the Cramer-Rao bound, which no method can beat. `--figure`
    varies one of the critical factors, as in the paper's figures 8 to 13.
    """
    from handeye_cli.simulate import figures, trials

    check_output(output)
    numbers = _figure_numbers(study.figure)
    _refuse_varied(numbers, experiment)
    pictures = _picture_files(plot, numbers, output)
    setting = _setting(experiment, levels)
    simulation = (
        figures.simulate_figures(numbers, setting, study.trials, study.seed)
        if numbers
        else trials.simulate(setting, study.trials, study.seed)
    )
    _draw(simulation, pictures, output)
    finish("simulate", simulation, output, [], given(experiment, levels, study))


def _setting(experiment: Experiment, levels: NoiseLevels) -> SimulationSetting:
    from handeye_cli.records import Noise
    from handeye_cli.records.simulation import SimulationSetting

    return SimulationSetting(
        stations=experiment.stations,
        distance=parse_length(experiment.distance),
        tilt=parse_angle(experiment.tilt),
        lever=parse_length(experiment.lever),
        noise=Noise(
            robot_rotation=parse_angle(levels.robot_rotation),
            robot_translation=parse_length(levels.robot_translation),
            camera_rotation=parse_angle(levels.camera_rotation),
            camera_translation=parse_length(levels.camera_translation),
        ),
        method=experiment.method,
        pairs=experiment.pairs.value,
    )


def _figure_numbers(text: str | None) -> list[int]:
    """Return the numbers of the figures asked for, none without `--figure`."""
    from handeye_cli.records.simulation import FIGURES

    known = {str(number): [number] for number in FIGURES} | {_ALL: list(FIGURES)}
    if text is None:
        return []
    if text not in known:
        raise UsageError(
            f"expected --figure {min(FIGURES)} to {max(FIGURES)} or {_ALL}, found {text!r}",
            hint="the other figures of the paper show no simulations",
        )
    return known[text]


def _refuse_varied(numbers: list[int], experiment: Experiment) -> None:
    """Refuse a flag that a figure would not heed; of several figures each heeds some."""
    from handeye_cli.records.simulation import FIGURES

    varied = {FIGURES[number][0].varied for number in numbers}
    for name in varied & set(given(experiment)) if len(numbers) == 1 else ():
        raise UsageError(
            f"--{name} {getattr(experiment, name)} has no effect: figure {numbers[0]} varies it",
            hint="leave the flag out, or ask for the single setting without --figure",
        )


def _picture_files(plot: Plot, numbers: list[int], output: Output) -> list[str]:
    """Return the file of each figure's picture, after making sure that they can be made."""
    if plot.plot is None:
        return []
    if not numbers:
        raise UsageError(
            "--plot draws a figure, and a single setting is none", hint="add --figure 8 to 13"
        )
    path = Path(plot.plot)
    files = [plot.plot]
    if len(numbers) > 1:
        files = [str(path.with_stem(f"{path.stem}-{number:02d}")) for number in numbers]
    check_plot(files, output)
    return files


def _draw(simulation: Simulation, pictures: list[str], output: Output) -> None:
    from handeye_cli import documents
    from handeye_cli.render.figure_plot import figure_png

    for figure, file in zip(simulation.figures if pictures else (), pictures, strict=True):
        documents.write_bytes(figure_png(figure, simulation), file, output.force)
