"""`handeye batch`: many recordings at once, with one table of what came of them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.batch_names import recording_names, unique_names
from handeye_cli.cli.batch_options import Kept, Labour, Recordings
from handeye_cli.cli.batch_run import progress, rows_of
from handeye_cli.cli.batch_work import Job
from handeye_cli.cli.camera_options import CameraFile
from handeye_cli.cli.checks import check_protocol, station_counts
from handeye_cli.cli.folders import make_folder
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import Opened, open_calibration
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Solver
from handeye_cli.cli.outputs import check_output, deliver, with_step
from handeye_cli.cli.verification_options import Protocol
from handeye_cli.conventions import parse_duration
from handeye_cli.engines import engine_of
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.batch import Treatment
    from handeye_cli.engines import Engine
    from handeye_cli.records.batch import Batch, BatchRow

EXAMPLES = (
    "handeye batch cells/*.mcap --setup eye-in-hand --target chessboard:9x6:23.6mm --jobs 4",
    "handeye batch @fleet.txt --out-dir answers --max-translation-mm 0.5 -o tonight.yaml",
    "handeye batch /data/*.mcap --calibration arm.yaml --scheduler tcp://10.0.0.5:8786",
)


def batch(
    *,
    recordings: Recordings,
    mcap: Mcap,
    camera_file: CameraFile,
    protocol: Protocol,
    intrinsics: Intrinsics,
    solver: Solver,
    labour: Labour,
    kept: Kept,
    output: Output,
) -> None:
    """Solve and verify many recordings, each on its own, and list what came of them.

    Every recording is treated as solve and verify would, with the same flags for all. One that
    fails does not keep the others from being done. The exit code is 0 when all are well, else the
    smallest that a single recording would have given (so 6, a limit that was missed, only where
    nothing failed), and 130 after Ctrl-C, which still writes what is done.
    """
    check_output(output)
    _check_flags(recordings, mcap, protocol, solver)
    existing = open_calibration(protocol.calibration)
    intrinsics_from = _file_of(camera_file)
    treatment = _treatment(protocol, intrinsics, solver, existing)
    names = recording_names(recordings.paths)
    engine = _engine(labour, len(names))
    if labour.scheduler is not None:
        # the workers have working folders of their own
        names = [str(Path(name).absolute()) for name in names]
        camera_file = _absolute(camera_file)
    keep = _keeper(kept, names, output)
    flags = given(recordings, mcap, camera_file, intrinsics, solver)
    jobs = [
        Job(_single(recordings, name), mcap, camera_file, treatment, flags, keep is not None)
        for name in names
    ]
    with progress(len(jobs), quiet=output.quiet) as tell:
        rows = rows_of(jobs, engine, keep, tell)
    inputs = [] if existing is None else [existing.file]
    _finish(_traced(rows, inputs + intrinsics_from, flags | given(protocol)), kept, output)


def _treatment(
    protocol: Protocol, intrinsics: Intrinsics, solver: Solver, existing: Opened | None
) -> Treatment:
    """Return how every recording is treated.

    Raises:
        UsageError: The counts of stations are no numbers.
    """
    from handeye_cli.batch import Treatment
    from handeye_cli.gates import Limits

    counts = station_counts(protocol)
    return Treatment(
        method=solver.method,
        pairs=solver.pairs.value,
        calibrate_intrinsics=intrinsics.calibrate_intrinsics,
        existing=None if existing is None else existing.record,
        counts=None if counts is None else tuple(counts),
        leave_one_out=protocol.leave_one_out,
        target_moved=protocol.target_moved,
        limits=Limits(protocol.max_rotation_mrad, protocol.max_translation_mm, protocol.strict),
    )


def _check_flags(recordings: Recordings, mcap: Mcap, protocol: Protocol, solver: Solver) -> None:
    """Refuse once what every recording would be refused for."""
    from handeye_cli import solvers

    solvers.load(solver.method)
    check_protocol(protocol)
    if recordings.target is not None:
        from handeye_cli import targets

        targets.parse(recordings.target)
    if mcap.time_offset is not None:
        parse_duration(mcap.time_offset)


def _engine(labour: Labour, count: int) -> Engine:
    """Return who works on this many recordings.

    Raises:
        UsageError: Two engines are asked for, or Dask is not installed.
    """
    if labour.scheduler is None:
        return engine_of("processes", min(count, labour.jobs or os.cpu_count() or 1))
    if labour.jobs is not None:
        raise UsageError(
            "expected --jobs or --scheduler, found both: a cluster has its own number of workers",
            hint="leave one of them out",
        )
    return engine_of("dask", labour.scheduler)


def _absolute(camera_file: CameraFile) -> CameraFile:
    name = camera_file.camera
    return camera_file if name is None else CameraFile(str(Path(name).absolute()))


def _single(recordings: Recordings, name: str) -> Recordings:
    return replace(recordings, source=name, further=None)


def _keeper(kept: Kept, names: Sequence[str], output: Output) -> Callable[[int, str], str] | None:
    """Return what writes the calibration of a recording, or None where none is to be written.

    Raises:
        UsageError: A file is there and not to be replaced, or is that of the table.
        InputError: The folder cannot be made.
    """
    if kept.out_dir is None:
        return None
    from handeye_cli import documents

    make_folder(kept.out_dir, "--out-dir")
    files = [str(Path(kept.out_dir, f"{name}.yaml")) for name in unique_names(names)]
    for file in files:
        documents.check_destination(file, output.force)
        if output.output and os.path.realpath(file) == os.path.realpath(output.output):
            raise UsageError(
                f"expected -o to be a file of its own, found {output.output}, which is that of a "
                "calibration",
                hint="write the table elsewhere",
            )

    def keep(index: int, document: str) -> str:
        documents.write_text(document, files[index], output.force)
        return files[index]

    return keep


def _file_of(camera_file: CameraFile) -> list[tuple[str, str]]:
    """Return the name and the digest of the file of the intrinsics, if there is one.

    Raises:
        InputError: It cannot be read; every recording would be refused for that.
    """
    from handeye_cli.documents import cameras

    name = camera_file.camera
    return [] if name is None else [(name, cameras.sha256_of(name))]


def _traced(
    rows: Sequence[BatchRow], files: Sequence[tuple[str, str]], flags: Mapping[str, Any]
) -> Batch:
    """Return the table, with what all recordings share as its inputs, by names and digests.

    Each row knows its recording's digest. What a calibration came of is told in its own document.
    """
    from handeye_cli.records.batch import Batch

    table = Batch(tuple(rows))
    return with_step(table, "batch", [Opened(table, file) for file in files], flags)


def _finish(batch: Batch, kept: Kept, output: Output) -> None:
    """Write and show the table, and leave with its exit code."""
    from handeye_cli.render.batch import show_batch, show_complaints, summary
    from handeye_cli.render.console import make_console

    rows = batch.rows if kept.times else [replace(row, seconds=None) for row in batch.rows]
    told = deliver(replace(batch, rows=tuple(rows)), output)
    if not told and sys.stdout.isatty() and not output.quiet:
        show_batch(batch, make_console(sys.stdout))
    else:
        show_complaints(batch, make_console(sys.stderr))
    if batch.exit_code:
        sys.stderr.write(f"error: {summary(batch)}\n")
    sys.exit(batch.exit_code)
