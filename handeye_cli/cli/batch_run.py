"""A batch while it runs: hand out the jobs, keep what comes back, and end well when interrupted."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from handeye_cli import __version__
from handeye_cli.cli.batch_work import Done, Job, carry_out
from handeye_cli.cli.flags import DEBUG
from handeye_cli.cli.lines import command_line
from handeye_cli.engines import Ended, Engine, WorkerDiedError
from handeye_cli.errors import HandeyeError, InputError, UsageError
from handeye_cli.records.batch import CANCELLED_CODE, BatchRow, BatchStatus

if TYPE_CHECKING:
    from rich.progress import Progress


def rows_of(
    jobs: Sequence[Job],
    engine: Engine,
    keep: Callable[[int, str], str] | None,
    tell: Callable[[int], None],
) -> list[BatchRow]:
    """Return a row for each job, in their order.

    Ctrl-C, or the signal that asks a process to end, cancels what is not done; the rows say so.

    Args:
        jobs: The recordings.
        engine: Who works on them.
        keep: Takes the number of a job and the document of its calibration, and returns the name
            of the file that has it now, or raises that it cannot be written.
        tell: Told how many are done.

    Raises:
        UsageError: The engine is not installed.
        InputError: The engine cannot be reached.
    """
    rows: dict[int, BatchRow] = {}
    try:
        with _interruptible(), closing(engine.run(carry_out, jobs)) as ends:
            for ended in ends:
                rows[ended.index] = _row(ended, jobs[ended.index], keep)
                tell(len(rows))
    except KeyboardInterrupt:
        pass
    return [rows.get(index, _cancelled(job)) for index, job in enumerate(jobs)]


@contextmanager
def progress(total: int, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Yield what shows how many recordings are done: a bar, where a person looks on.

    Args:
        total: Number of recordings.
        quiet: Whether nothing is shown.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    with _bar() as bar:
        task = bar.add_task("recordings", total=total)
        yield lambda done: bar.update(task, completed=done)


def _bar() -> Progress:
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let the signal that asks a process to end do what Ctrl-C does."""
    handlers: dict[int, Any] = {signal.SIGTERM: signal.default_int_handler}
    if hasattr(signal, "SIGPIPE"):
        # a worker that dies closes its pipe, and that must not end the one that writes into it
        handlers[signal.SIGPIPE] = signal.SIG_IGN
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _row(ended: Ended[Done], job: Job, keep: Callable[[int, str], str] | None) -> BatchRow:
    if ended.result is None:
        return _faulty(job, ended.fault)
    row, document = ended.result.row, ended.result.document
    if document is None or keep is None:
        return row
    try:
        return replace(row, calibration=keep(ended.index, document))
    except (InputError, UsageError) as error:
        from handeye_cli.batch import failed

        return failed(row, error)


def _faulty(job: Job, fault: BaseException | None) -> BatchRow:
    """Return the row of a job that ended without a result, which no error of ours explains."""
    name = job.source.source
    if isinstance(fault, WorkerDiedError | MemoryError):
        message = str(fault) or "memory ran out"
        line = command_line("solve", name)
        advice = f"run {line} alone; the fewer at a time, the more memory for each"
    else:
        what = f"{type(fault).__name__}: {' '.join(str(fault).split())}"
        message = f"a bug in handeye {__version__}: {what}"
        line = command_line("solve", name, [DEBUG])
        advice = f"run {line} and send the traceback to the maintainers"
    return BatchRow(
        name, BatchStatus.FAILED, HandeyeError.exit_code, message=message, advice=advice
    )


def _cancelled(job: Job) -> BatchRow:
    return BatchRow(job.source.source, BatchStatus.CANCELLED, CANCELLED_CODE)
