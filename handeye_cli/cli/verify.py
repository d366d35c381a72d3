"""`handeye verify`: errors on stations that took no part in the calibration."""

from __future__ import annotations

from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.checks import check_protocol, station_counts
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import open_calibration
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Solver, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.progress import steps
from handeye_cli.cli.verification_options import Protocol

EXAMPLES = (
    "handeye verify recording.yaml --stations 4,6,8,10,12",
    "handeye verify new.mcap --calibration calibration.yaml --max-translation-mm 0.5",
)


def verify(
    *,
    source: Source,
    mcap: Mcap,
    camera_file: CameraFile,
    protocol: Protocol,
    intrinsics: Intrinsics,
    solver: Solver,
    work: Work,
    output: Output,
) -> None:
    """Measure the error of a calibration on stations that took no part in it.

    For each N of --stations it calibrates on stations 1 to N and predicts the camera's pose at
    stations N+1 to 2N; with --leave-one-out it predicts each station from all others; with
    --calibration it checks an existing answer on all stations.
    """
    from handeye_cli import gates, pipeline, solvers

    check_output(output)
    solvers.load(solver.method)
    check_protocol(protocol)
    counts = station_counts(protocol)
    existing = open_calibration(protocol.calibration)
    inputs = open_inputs(source, mcap, camera_file)
    opened = inputs[0]
    with opened.blamed(), steps(work, output, intrinsics) as how:
        verification = pipeline.to_verification(
            opened.record,
            how,
            None if existing is None else existing.record,
            counts=counts,
            method=solver.method,
            pairs=solver.pairs.value,
            leave_one_out=protocol.leave_one_out,
            target_moved=protocol.target_moved,
        )
    flags = given(source, mcap, camera_file, protocol, intrinsics, solver)
    inputs += [] if existing is None else [existing]
    finish("verify", verification, output, inputs, flags)
    gates.check_limits(
        verification,
        gates.Limits(protocol.max_rotation_mrad, protocol.max_translation_mm, protocol.strict),
    )
