"""`handeye extrinsics`: from points in the pictures to the target's pose at every station."""

from __future__ import annotations

from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.grouping import given
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.progress import steps

EXAMPLES = (
    "handeye extrinsics features.yaml -o stations.yaml",
    "handeye extrinsics recording.yaml --calibrate-intrinsics -o stations.yaml",
)


def extrinsics(
    *,
    source: Source,
    mcap: Mcap,
    camera_file: CameraFile,
    intrinsics: Intrinsics,
    work: Work,
    output: Output,
) -> None:
    """Compute the pose of the target in the camera at every station, with its covariance.

    The intrinsics are taken from the input, or estimated from the same pictures with
    --calibrate-intrinsics; the pixels stay in the document, so that solve can use them.
    """
    from handeye_cli import pipeline
    from handeye_cli.records import Features, Recording

    check_output(output)
    inputs = open_inputs(source, mcap, camera_file)
    opened = inputs[0]
    with opened.blamed(), steps(work, output, intrinsics) as how:
        pipeline.expect(opened.record, Recording, Features)
        stations = pipeline.to_stations(opened.record, how)
    finish("extrinsics", stations, output, inputs, given(source, mcap, camera_file, intrinsics))
