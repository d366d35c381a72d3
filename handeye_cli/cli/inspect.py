"""`handeye inspect`: what is right and what is wrong with the data."""

from __future__ import annotations

from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import open_input
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.progress import steps

EXAMPLES = (
    "handeye inspect stations.yaml",
    "handeye inspect data.mcap --setup eye-in-hand --target disc-grid:6x6:5mm:4mm --json",
)


def inspect(
    *, source: Source, mcap: Mcap, intrinsics: Intrinsics, work: Work, output: Output
) -> None:
    """Look at the data before or instead of a calibration, and say what is wrong with them.

    Conventions, bad stations, directions that are not determined, and whether the robot, the camera
    or the plate is the limit. Exit code 4 when an answer would be meaningless; the findings are
    reported all the same.
    """
    from handeye_cli import pipeline

    check_output(output)
    opened = open_input(source, mcap)
    with opened.blamed(), steps(work, output, intrinsics) as how:
        inspection = pipeline.to_inspection(opened.record, how)
    finish("inspect", inspection, output, [opened], given(source, mcap, intrinsics))
    pipeline.require_meaning(inspection)
