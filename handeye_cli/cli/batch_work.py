"""What is done for one recording of a batch, wherever that is; all of it can be pickled."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from handeye_cli import __version__
from handeye_cli.cli.batch_options import Recordings
from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.options import Mcap
from handeye_cli.cli.outputs import with_step
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.batch import Treatment
    from handeye_cli.records.batch import BatchRow


@dataclass(frozen=True)
class Job:
    """One recording, and all that the work on it needs to know.

    Attributes:
        source: The recording, with the flags about it.
        mcap: What is taken from a robot's recording.
        camera_file: Intrinsics that win over the recording's own.
        treatment: How it is solved and verified.
        flags: The flags that `handeye solve` would have been given.
        keeps: Whether the document of the calibration is wanted.
        version: Of the tool that hands out the job.
    """

    source: Recordings
    mcap: Mcap
    camera_file: CameraFile
    treatment: Treatment
    flags: Mapping[str, Any]
    keeps: bool
    version: str = __version__


@dataclass(frozen=True)
class Done:
    """What came of a job.

    Attributes:
        row: Its line of the table.
        document: The calibration as `handeye solve` would write it, where it is wanted and found.
    """

    row: BatchRow
    document: str | None = None


def carry_out(job: Job) -> Done:
    """Solve and verify a recording."""
    from handeye_cli import batch, documents

    inputs: list[Opened] = []

    def opening() -> tuple[Any, str]:
        _require_version(job.version)
        inputs.extend(open_inputs(job.source, job.mcap, job.camera_file))
        return inputs[0].record, inputs[0].file[1]

    start = time.perf_counter()
    outcome = batch.outcome_of(job.source.source, opening, job.treatment)
    document = None
    if job.keeps and outcome.calibration is not None:
        answer = with_step(outcome.calibration, "solve", inputs, job.flags)
        document = documents.dump(answer, "yaml")
    return Done(replace(outcome.row, seconds=time.perf_counter() - start), document)


def _require_version(version: str) -> None:
    if version != __version__:
        raise UsageError(
            f"expected handeye {version} on every worker, found {__version__}",
            hint="install the same version on all machines of the cluster",
        )
