"""`handeye extract`: from pictures to the target's points in them."""

from __future__ import annotations

from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.grouping import given
from handeye_cli.cli.options import Mcap, Output, Pictures, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.pictures import draw_pictures, prepared_folder
from handeye_cli.cli.progress import steps

EXAMPLES = (
    "handeye extract data.mcap --target disc-grid:6x6:5mm:4mm --draw pictures",
    "handeye extract recording.yaml | handeye extrinsics - | handeye solve -",
)


def extract(
    *,
    source: Source,
    mcap: Mcap,
    camera_file: CameraFile,
    work: Work,
    output: Output,
    pictures: Pictures,
) -> None:
    """Find the calibration target's points in the pictures of a recording.

    Every station is kept: one whose picture does not show the target says why, and the robot's
    poses go along with the points. `--draw` shows what was found, and where.
    """
    from handeye_cli import pipeline
    from handeye_cli.records import Recording

    check_output(output)
    inputs = open_inputs(source, mcap, camera_file)
    opened = inputs[0]
    with opened.blamed(), steps(work, output) as how:
        pipeline.expect(opened.record, Recording)
        with prepared_folder(pictures, output, opened.record):
            features = pipeline.to_features(opened.record, how)
            draw_pictures(pictures, output, opened.record, features, how)
    finish("extract", features, output, inputs, given(source, mcap, camera_file))
