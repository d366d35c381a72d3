"""Work in a process of its own, so that its time and its peak of memory are its own."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Else threads that wait for each other are counted as work."""


@dataclass(frozen=True)
class Cost:
    """What a piece of work took.

    Attributes:
        result: What it returned.
        clock: Seconds of the clock.
        processor: Seconds of the processors.
        read: Bytes read from files; not a number where nobody counts them.
        before: Bytes of memory before it, at most.
        peak: Bytes of memory up to its end, at most.
    """

    result: Any
    clock: float
    processor: float
    read: float
    before: float
    peak: float


def alone(work: Callable[..., Any], *arguments: Any) -> Cost:
    """Do a piece of work in a new process, with one thread for linear algebra."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(_measured, work, arguments).result()


def _measured(work: Callable[..., Any], arguments: Sequence[Any]) -> Cost:
    before, read = _peak(), _bytes_read()
    clock, processor = time.perf_counter(), time.process_time()
    result = work(*arguments)
    taken = time.perf_counter() - clock, time.process_time() - processor
    return Cost(result, *taken, _bytes_read() - read, before, _peak())


def _peak() -> float:
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:  # what is known elsewhere starts with the peak of the process that started it
        scale = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale
    (peak,) = [line.split()[1] for line in lines if line.startswith("VmHWM:")]
    return int(peak) * 1024


def _bytes_read() -> float:
    try:
        counters = Path("/proc/self/io").read_text(encoding="ascii").split()
    except OSError:
        return float("nan")
    return float(counters[counters.index("rchar:") + 1])


def timed(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """Return a result and the seconds of this process's processor that it took."""
    start = time.process_time()
    result = work(*arguments)
    return result, time.process_time() - start


def command_times(command: Sequence[str], environment: Mapping[str, str]) -> tuple[float, float]:
    """Run a command; return its seconds of the processors and of the clock."""
    before, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, env=environment)
    clock = time.perf_counter() - clock
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, clock
