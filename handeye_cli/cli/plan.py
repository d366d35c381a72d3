"""`handeye plan`: where to send the robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.checks import distance_of
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import Opened, as_calibration, open_input
from handeye_cli.cli.options import Mcap, Output, Source
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.plan_options import CellLimits, Journey, Layout, Levels
from handeye_cli.cli.plan_texts import lever_of, limits_of, noise_of
from handeye_cli.cli.plot_files import check_plot
from handeye_cli.conventions import parse_angle
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.documents.cameras import CameraSource
    from handeye_cli.planning.options import PlanOptions
    from handeye_cli.records import FloatArray, Plan

EXAMPLES = (
    "handeye plan --stations 7 --distance 170mm --tilt 30deg",
    "handeye plan --stations 9 --distance 0.4m --tilt 25deg --target chessboard:9x6:23.6mm \\\n"
    "      --calibration first.yaml --verification 4 -o plan.yaml",
    "handeye plan --stations 7 --calibration first.yaml --target disc-grid:6x6:5mm:4mm \\\n"
    "      --optimize --box 200,-300,100,800,300,600mm --shortest-way --csv plan.csv",
    "handeye plan --after stations.yaml --stations 2",
)
_STANDS_ALONE = ("distance", "tilt", "calibration", "base_T_target", "verification", "optimize")
"""Flags of the layout that have nothing to say where a recording is there already."""


def plan(
    *, layout: Layout, cell_limits: CellLimits, levels: Levels, journey: Journey, output: Output
) -> None:
    """Lay out stations that calibrate well: the paper's circle of tilted views of the target.

    The camera's poses are relative to the target; with a first calibration the robot's poses are
    planned too. The aim point is the target's origin, or the centre of the --target. A station that
    breaks a limit of the cell moves to the nearest allowed place. --optimize chooses the stations
    that make the predicted error smallest, --after those to add to a recording.
    """
    check_output(output)
    _check_journey(journey, output)
    options = _options(layout, cell_limits, levels, journey)
    if layout.after is None:
        planned, inputs = _planned(layout, cell_limits.camera, options)
    else:
        planned, inputs = _further(layout, layout.after, cell_limits.camera, options)
    finish("plan", planned, output, inputs, given(layout, cell_limits, levels, journey))
    _write_journey(planned, journey, output)


def _options(layout: Layout, limits: CellLimits, levels: Levels, journey: Journey) -> PlanOptions:
    from handeye_cli.planning.options import PlanOptions

    return PlanOptions(
        given=noise_of(levels),
        lever=lever_of(levels),
        limits=limits_of(limits),
        optimize=layout.optimize,
        shortest_way=journey.shortest_way,
    )


def _planned(layout: Layout, camera: str | None, options: PlanOptions) -> tuple[Plan, list[Opened]]:
    from handeye_cli import pipeline, targets

    distance, tilt = distance_of(layout.distance), parse_angle(layout.tilt)
    guess, existing = _first_answer(layout.calibration)
    seen_by = None if camera is None else _seen_by(camera, layout)
    if seen_by is not None:
        options = replace(options, camera=seen_by.camera)
    planned = pipeline.to_plan(
        layout.stations,
        distance=distance,
        tilt=tilt,
        target=None if layout.target is None else targets.parse(layout.target),
        setup=layout.setup,
        calibration=None if existing is None else existing.record,
        verification=layout.verification,
        mount_T_camera=guess,
        reference_T_target=_target_guess(layout.base_T_target),
        options=options,
    )
    inputs = [] if existing is None else [existing]
    if seen_by is not None:
        # Intrinsics have no provenance, and neither has the plan so far.
        inputs.append(Opened(planned, (seen_by.name, seen_by.sha256)))
    return planned, inputs


def _further(
    layout: Layout, after: str, camera: str | None, options: PlanOptions
) -> tuple[Plan, list[Opened]]:
    from handeye_cli import pipeline

    flags = given(layout)
    for name in _STANDS_ALONE:
        flag = name.replace("_", "-")
        if flag in flags:
            raise UsageError(
                f"--{flag} cannot act on --after: places are chosen like those recorded",
                hint="limit them with --depth and --max-tilt",
            )
    if camera is not None:
        raise UsageError("--camera cannot act on --after: the recording has its own intrinsics")
    opened = _open(after, layout.target, layout.setup)
    with opened.blamed():
        planned = pipeline.to_further_stations(
            opened.record, pipeline.Steps(), layout.stations, options=options
        )
    return planned, [opened]


def _open(source: str, target: str | None = None, setup: Any = None) -> Opened:
    return open_input(Source(source, target=target, setup=setup), Mcap())


def _first_answer(text: str | None) -> tuple[FloatArray | None, Opened | None]:
    """Return the pose that --calibration states, or the calibration that it names."""
    if text is None:
        return None, None
    from handeye_cli import documents
    from handeye_cli.documents import pose_guess

    stated = pose_guess.pose_of_numbers(text)
    if stated is not None:
        return stated, None
    content = documents.read_bytes(text)  # once: what was read from a pipe is gone
    stated = pose_guess.pose_in(content, text)
    if stated is not None:
        return stated, None
    read = documents.source_of(text, content)
    return None, as_calibration(Opened(read.record, (read.name, read.sha256)))


def _target_guess(text: str | None) -> FloatArray | None:
    if text is None:
        return None
    from handeye_cli.documents.pose_guess import read_stated_pose

    return read_stated_pose("--base-T-target", text)


def _seen_by(camera: str, layout: Layout) -> CameraSource:
    """Read the intrinsics of --camera, which have no part in a plan without a target."""
    from handeye_cli.documents import cameras

    if layout.target is None:
        raise UsageError(
            "--camera tells what is seen of a target, and there is none",
            hint="name it with --target, such as --target disc-grid:6x6:5mm:4mm",
        )
    return cameras.read(camera, None)


def _check_journey(journey: Journey, output: Output) -> None:
    from handeye_cli import documents

    for path in (journey.csv, journey.mcap):
        if path is not None:
            documents.check_destination(path, output.force)
    if journey.plot is not None:
        check_plot([journey.plot], output)


def _write_journey(planned: Plan, journey: Journey, output: Output) -> None:
    from handeye_cli import documents
    from handeye_cli.planning import table

    if journey.csv is not None:
        documents.write_text(table.csv_text(planned), journey.csv, output.force)
    if journey.mcap is not None:
        from handeye_cli.recording.pose_array import mcap_bytes

        parent, _ = table.frames_of(planned)
        content = mcap_bytes(table.poses_of(planned), parent)
        documents.write_bytes(content, journey.mcap, output.force)
    if journey.plot is not None:
        from handeye_cli.render.plan_plot import plan_png

        documents.write_bytes(plan_png(planned), journey.plot, output.force)
