"""Accuracy of every method against the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.effort import Effort
from benchmarks.solving import opencv
from benchmarks.solving.layouts import (
    NOISE,
    bound,
    general_layout,
    noisy,
    paper_layout,
    perfect,
    rms,
)
from benchmarks.tables import Column, Table
from handeye_cli import solve_batch, solvers

COUNTS = (3, 7, 12)
LAYOUTS = {"paper": paper_layout, "general": general_layout}
HEADS = (
    Column("method"),
    *(
        Column(f"{part}, N = {count}", ".2f")
        for count in COUNTS
        for part in ("rotation", "translation")
    ),
    Column("no answer", "d"),
)
NOTE = """RMS error over the Cramer-Rao bound, which no method can beat. Closed forms use the
pairs of the star here, all pairs in OpenCV."""


def case_of(layout, count, effort):
    rng = np.random.default_rng([effort.seed, count])
    A, B, X, Z, of_camera = perfect(rng, layout, count)
    measured = noisy(rng, A, B, of_camera, effort.trials)
    return (*measured, of_camera, X, bound(A, B, X, Z, of_camera))


def ours(method, case):
    A, B, of_camera, X, best = case
    found = solve_batch(A, B, method=method, noise=NOISE, camera_covariance=of_camera)
    return rms(found.mount_T_camera, X) / best, 0


def theirs(name, case):
    A, B, _, X, best = case
    found = [opencv.solve(name, a, b) for a, b in zip(A, B, strict=True)]
    good = [each for each in found if each is not None and np.all(np.isfinite(each))]
    ratios = rms(np.array(good), X) / best if good else (np.nan, np.nan)
    return ratios, len(found) - len(good)


def row(name, results):
    ratios, failed = zip(*results, strict=True)
    return (name, *np.ravel(ratios), sum(failed))


def tables(effort: Effort) -> Iterator[Table]:
    methods = sorted(solvers.names(), key=lambda name: name != solvers.DEFAULT)
    for key, layout in LAYOUTS.items():
        cases = [case_of(layout, count, effort) for count in COUNTS]
        rows = [row(method, [ours(method, case) for case in cases]) for method in methods]
        rows += [
            row(f"OpenCV {name}", [theirs(name, case) for case in cases]) for name in opencv.METHODS
        ]
        title = f"Accuracy of a solution: {layout.__doc__.splitlines()[0].rstrip('.')}"
        yield Table(f"solving_{key}", title, HEADS, rows, NOTE + opencv.REMARK)
