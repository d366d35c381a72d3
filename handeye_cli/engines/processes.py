"""Jobs in processes of this machine, by the pool of Python's own library.

At most as many jobs as processes are handed out at a time. When a process dies the pool cannot say
which job it was, so each of these few is done once more in a process of its own: the one that dies
again is the culprit, and the others are none the worse for it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Thread

from handeye_cli.engines import Ended, Given, Made, WorkerDiedError

_SINGLE_THREADED = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)
"""What the libraries read once, when they are loaded."""

_DIED = "the process that worked on it died, as when memory runs out"


def engine(workers: int) -> Processes:
    """Return the engine with this many processes."""
    return Processes(workers)


@dataclass(frozen=True)
class Processes:
    """An `Engine` on the processors of this machine.

    Attributes:
        workers: Processes at the same time.
    """

    workers: int

    def run(
        self, work: Callable[[Given], Made], jobs: Sequence[Given]
    ) -> Generator[Ended[Made], None, None]:
        """Yield every job's end, in the order they come; see `Engine`."""
        turns = deque([(deque(enumerate(jobs)), max(1, min(self.workers, len(jobs))))])
        while turns:
            waiting, workers = turns.popleft()
            suspects = yield from _in_pool(work, waiting, workers)
            for suspect in suspects:
                if workers == 1:
                    yield Ended(suspect[0], fault=WorkerDiedError(_DIED))
                else:
                    turns.append((deque([suspect]), 1))
            if waiting:
                turns.append((waiting, workers))


def _in_pool(
    work: Callable[[Given], Made], waiting: deque[tuple[int, Given]], workers: int
) -> Generator[Ended[Made], None, list[tuple[int, Given]]]:
    """Do jobs until all are done or a process dies.

    Args:
        work: What is done.
        waiting: Numbered jobs; those that were begun are taken out.
        workers: Processes.

    Yields:
        The ends of jobs.

    Returns:
        The jobs that were under way when a process died.
    """
    running: dict[Future[Made], tuple[int, Given]] = {}
    with _pool(workers) as pool:
        while waiting or running:
            while waiting and len(running) < workers:
                future = _submit(pool, work, waiting[0][1])
                if future is None:
                    return list(running.values())
                running[future] = waiting.popleft()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                fault = future.exception()
                if isinstance(fault, BrokenProcessPool):
                    return list(running.values())
                index, _ = running.pop(future)
                yield Ended(index, None if fault else future.result(), fault)
    return []


def _submit(
    pool: ProcessPoolExecutor, work: Callable[[Given], Made], job: Given
) -> Future[Made] | None:
    """Hand out a job; None when a process of the pool has died since it was last looked at."""
    try:
        return pool.submit(work, job)
    except BrokenProcessPool:
        return None


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool; what its processes still do when it is left by an exception is given up."""
    others = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_prepare)
    try:
        yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _prepare() -> None:
    """Make a new process one that shares the machine, and ends with the one that started it."""
    # a Ctrl-C reaches every process of a terminal; the first of them decides what becomes of it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.update(dict.fromkeys(_SINGLE_THREADED, "1"))
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
