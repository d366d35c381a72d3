"""`handeye simulate recording`: a recording whose truth is known, with mistakes where wanted."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from handeye_cli import __version__
from handeye_cli.cli.grouping import given
from handeye_cli.cli.lines import command_line
from handeye_cli.cli.options import Output, Work
from handeye_cli.cli.outputs import STDOUT, print_text
from handeye_cli.cli.progress import steps
from handeye_cli.cli.recording_files import DOCUMENT, prepared_folder, write_folder, write_mcap
from handeye_cli.cli.simulate_recording_inputs import Wish, wish_of
from handeye_cli.cli.simulate_recording_options import (
    Camerawork,
    Disturbance,
    Made,
    Optics,
    Scenery,
)
from handeye_cli.conventions import parse_duration
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.records import ProvenanceStep
    from handeye_cli.simulate.footage import Footage
    from handeye_cli.simulate.recording import SimulatedRecording

EXAMPLES = (
    "handeye simulate recording --seed 7 -o made --truth truth.yaml",
    "handeye simulate recording --plan plan.yaml --fault swapped:3,7 -o swapped.mcap",
)
_MCAP = ".mcap"


def simulate_recording(
    *, scenery: Scenery, optics: Optics, chance: Disturbance, camerawork: Camerawork, made: Made
) -> None:
    """Make a recording whose truth is known: rendered pictures, and the poses of a noisy robot.

    It is a folder with a recording document and its images, or the MCAP file of a robot's run with
    motion, pauses, TF and CameraInfo. Faults can be put into it, such as a plate that was moved
    half-way, to see what comes of them.
    """
    _refuse_stream(made)
    wish = wish_of(scenery, optics, chance)
    simulated = wish.simulated()
    step = _step(wish, given(scenery, optics, chance, camerawork))
    if made.output.lower().endswith(_MCAP):
        _film(simulated, camerawork, made, step)
    else:
        _refuse_motion(camerawork, simulated)
        _photograph(simulated, made, step)
    _write_truth(wish, simulated, made, step)
    _report(wish, simulated, made)


def _refuse_stream(made: Made) -> None:
    if made.output == STDOUT:
        raise UsageError(
            "expected -o to be a folder or a file that ends in .mcap, found '-', which stands for "
            "a stream",
            hint="./- is a folder of that name",
        )


def _step(wish: Wish, flags: dict[str, object]) -> ProvenanceStep:
    from handeye_cli.records import ProvenanceStep

    if wish.faults:
        flags = flags | {"fault": " ".join(fault.text for fault in wish.faults)}
    files = tuple(file for each in wish.inputs for file in each.files)
    return ProvenanceStep("simulate recording", __version__, files, flags)


def _refuse_motion(camerawork: Camerawork, simulated: SimulatedRecording) -> None:
    flags = [f"--{name}" for name in given(camerawork)]
    if simulated.staging.image_lag_ns:
        flags.append("--fault time-offset")
    if flags:
        raise UsageError(
            f"{flags[0]} acts on an MCAP recording only, and -o names a folder",
            hint="leave it out, or let the name after -o end in .mcap",
        )


def _photograph(simulated: SimulatedRecording, made: Made, step: ProvenanceStep) -> None:
    with prepared_folder(made.output, simulated.staging.names, made.force) as folder:
        _check_truth(made)
        with steps(Work(), Output(quiet=made.quiet)) as how:
            write_folder(simulated, folder, step, how.progress)


def _film(
    simulated: SimulatedRecording, camerawork: Camerawork, made: Made, step: ProvenanceStep
) -> None:
    from handeye_cli import documents

    footage = _footage(simulated, camerawork)
    documents.check_destination(made.output, made.force)
    _check_truth(made)
    with steps(Work(), Output(quiet=made.quiet)) as how:
        write_mcap(
            footage,
            made.output,
            step,
            how.progress,
            compressed=not camerawork.raw,
            force=made.force,
        )


def _footage(simulated: SimulatedRecording, camerawork: Camerawork) -> Footage:
    from handeye_cli.simulate.footage import Footage, Shooting

    pause_ns = parse_duration(camerawork.pause)
    return Footage(simulated, Shooting(camerawork.rate, camerawork.tf_rate, pause_ns))


def _check_truth(made: Made) -> None:
    if made.truth is not None:
        from handeye_cli import documents

        documents.check_destination(made.truth, made.force)


def _write_truth(
    wish: Wish, simulated: SimulatedRecording, made: Made, step: ProvenanceStep
) -> None:
    if made.truth is None:
        return
    from handeye_cli import documents
    from handeye_cli.simulate.truth import truth_of

    truth = truth_of(simulated, wish.rig.noise, wish.faults, (step,))
    documents.write(truth, made.truth, made.force)


def _report(wish: Wish, simulated: SimulatedRecording, made: Made) -> None:
    from handeye_cli.simulate.truth import out_of_view

    finding = out_of_view(simulated)
    if finding is not None:
        from handeye_cli.render.console import make_console, show_findings

        show_findings(make_console(sys.stderr), [finding])
    if sys.stdout.isatty() and not made.quiet:
        count = len(simulated.base_T_gripper)
        print_text(f"{made.output}: {count} stations\n  next: {_next(wish, made)}\n")


def _next(wish: Wish, made: Made) -> str:
    """Return the command that solves the recording."""
    if not made.output.lower().endswith(_MCAP):
        return command_line("solve", str(Path(made.output) / DOCUMENT))
    from handeye_cli import targets

    target = targets.shorthand(wish.rig.target)
    flags = ("--setup", str(wish.rig.setup), "--target", target)
    return command_line("solve", made.output, flags)
