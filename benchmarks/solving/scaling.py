"""Time and memory of one solution against the number of stations."""

from __future__ import annotations

import statistics
from collections.abc import Iterator

import cv2
import numpy as np

from benchmarks.effort import Effort
from benchmarks.processes import alone, timed
from benchmarks.solving import opencv
from benchmarks.solving.layouts import general_layout, noisy, perfect
from benchmarks.tables import Column, Table
from handeye_cli import solve_poses

COUNTS = (10, 100, 1000, 8000)
METHODS = ("maximum-likelihood", "tsai-lenz", "park-martin", "shah")
THEIRS = "OpenCV "
SLOWEST = 20.0
"""Seconds that one call of OpenCV may take; larger numbers of stations are left out."""
RECORDINGS = 5
"""Of which the median is told: the noise in some of them needs a longer way than in others."""
MB = 1e6
NOTE = f"""Seconds of one solution with its predicted error, the median over {RECORDINGS} recordings
(OpenCV: one, without), and the most memory of the process. This project's time grows with the
stations, OpenCV's with their pairs."""


def recording(rng, count):
    """Return poses of robot and target with noise, and the covariance of the target's."""
    A, B, *_, of_camera = perfect(rng, general_layout, count)
    A, B = (poses[0] for poses in noisy(rng, A, B, of_camera, 1))
    return A, B, of_camera


def solve(name, A, B, of_camera):
    return solve_poses(A, B, method=name, camera_covariance=of_camera)


def measure(count, name):
    """Seconds of one solution."""
    rng = np.random.default_rng(count)
    if name.startswith(THEIRS):
        A, B, _ = recording(rng, count)
        cv2.setNumThreads(1)
        return timed(opencv.solve, name.removeprefix(THEIRS), A, B)[1]
    solve(name, *recording(rng, COUNTS[0]))  # whatever is loaded on first use
    return statistics.median(
        timed(solve, name, *recording(rng, count))[1] for _ in range(RECORDINGS)
    )


def row(name, counts):
    taken, peak = [], np.nan
    for count in counts:
        growth = (count / counts[len(taken) - 1]) ** 2 if taken else 0.0
        if name.startswith(THEIRS) and growth * max(taken, default=0.0) > SLOWEST:
            break
        cost = alone(measure, count, name)
        taken.append(cost.result)
        peak = cost.peak / MB
    missing = [np.nan] * (len(counts) - len(taken))
    growth = taken[-1] / taken[-2] if len(taken) == len(counts) > 1 else np.nan
    return (name, *taken, *missing, growth, peak)


def tables(effort: Effort) -> Iterator[Table]:
    counts = [count for count in COUNTS if count <= effort.largest]
    heads = (
        Column("method"),
        *(Column(f"N = {count} [s]", ".4f") for count in counts),
        Column("last / before", ".1f"),
        Column("peak [MB]", ".0f"),
    )
    names = [*METHODS, *(f"{THEIRS}{name}" for name in opencv.HAND_EYE)]
    rows = [row(name, counts) for name in names]
    yield Table("solving_time", "Time of a solution", heads, rows, NOTE + opencv.REMARK)
