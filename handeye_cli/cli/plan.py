"""`handeye plan`: where to send the robot."""

from __future__ import annotations

from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import open_calibration
from handeye_cli.cli.options import Layout, Output
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.conventions import parse_angle, parse_length

EXAMPLES = (
    "handeye plan --stations 7 --distance 170mm --tilt 30deg",
    "handeye plan --stations 9 --distance 0.4m --tilt 25deg --target chessboard:9x6:23.6mm \\\n"
    "      --calibration first.yaml --verification 4 -o plan.yaml",
)


def plan(*, layout: Layout, output: Output) -> None:
    """Lay out stations that calibrate well: the paper's circle of tilted views of the target.

    The camera's poses are relative to the target; with a first calibration the robot's poses are
    planned too. The aim point is the target's origin, or the centre of the --target.
    """
    from handeye_cli import pipeline, targets

    check_output(output)
    distance, tilt = parse_length(layout.distance), parse_angle(layout.tilt)
    existing = open_calibration(layout.calibration)
    planned = pipeline.to_plan(
        layout.stations,
        distance=distance,
        tilt=tilt,
        target=None if layout.target is None else targets.parse(layout.target),
        setup=layout.setup,
        calibration=None if existing is None else existing.record,
        verification=layout.verification,
    )
    finish("plan", planned, output, [] if existing is None else [existing], given(layout))
