"""`handeye solve`: from whatever there is to where the camera sits."""

from __future__ import annotations

from handeye_cli.cli.answer_file import AnswerFile, check_answer_file, write_answer
from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.grouping import given
from handeye_cli.cli.options import Intrinsics, Mcap, Methods, Output, Solver, Source, Work
from handeye_cli.cli.outputs import check_output, finish
from handeye_cli.cli.progress import steps

EXAMPLES = (
    "handeye solve data.mcap --target charuco:5x7:36mm:18mm:DICT_6X6_250",
    "handeye solve part_0.mcap part_1.mcap --setup eye-in-hand --target chessboard:9x6:23.6mm \\\n"
    "      -o calibration.yaml --mcap answer.mcap",
    "handeye solve stations.yaml --method tsai-lenz -o calibration.yaml",
)


def solve(
    *,
    source: Source,
    mcap: Mcap,
    camera_file: CameraFile,
    intrinsics: Intrinsics,
    solver: Solver,
    methods: Methods,
    answer: AnswerFile,
    work: Work,
    output: Output,
) -> None:
    """Calibrate: find the camera's pose on the gripper (or on the base) and its expected error.

    The input is a recording, or any document on the way from it; a stations document needs no
    pictures at all. Data that contradict their conventions are refused, with the likely mistake.
    """
    from handeye_cli import pipeline, solvers

    check_output(output)
    check_answer_file(answer, source, methods, output)
    solvers.load(solver.method)
    inputs = open_inputs(source, mcap, camera_file)
    opened = inputs[0]
    with opened.blamed(), steps(work, output, intrinsics) as how:
        calibration = pipeline.to_calibration(
            opened.record,
            how,
            method=solver.method,
            pairs=solver.pairs.value,
            compare=methods.compare,
            partial=methods.partial,
        )
    write_answer(calibration, answer, opened, output)
    flags = given(source, mcap, camera_file, intrinsics, solver, methods)
    finish("solve", calibration, output, inputs, flags)
