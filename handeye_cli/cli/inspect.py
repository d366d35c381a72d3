"""`handeye inspect`: what is right and what is wrong with the data."""

from __future__ import annotations

from dataclasses import replace

from handeye_cli.cli.camera_options import CameraFile
from handeye_cli.cli.grouping import given
from handeye_cli.cli.looked import open_both
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.progress import steps

EXAMPLES = (
    "handeye inspect data.mcap",
    "handeye inspect stations.yaml",
    "handeye inspect data.mcap --setup eye-in-hand --target disc-grid:6x6:5mm:4mm --json",
)


def inspect(
    *,
    source: Source,
    mcap: Mcap,
    camera_file: CameraFile,
    intrinsics: Intrinsics,
    work: Work,
    output: Output,
) -> None:
    """Look at the data before or instead of a calibration, and say what is wrong with them.

    Of a robot's recording: topics, frames, pauses, what would be used, and the command to run. With
    --setup and --target, and of any document: conventions, bad stations, directions that are not
    determined, and whether the robot, the camera or the plate is the limit. Exit code 4 when an
    answer would be meaningless; the findings are reported all the same.
    """
    from handeye_cli import gates, pipeline

    check_output(output)
    flags = given(source, mcap, camera_file, intrinsics)
    inputs, summary = open_both(source, mcap, camera_file, flags)
    if summary is not None and inputs[0].record is summary:
        inspection = summary
    else:
        with inputs[0].blamed(), steps(work, output, intrinsics) as how:
            inspection = pipeline.to_inspection(inputs[0].record, how)
        if summary is not None:
            inspection = replace(inspection, recording=summary.recording)
    finish("inspect", inspection, output, inputs, flags)
    gates.require_meaning(inspection)
