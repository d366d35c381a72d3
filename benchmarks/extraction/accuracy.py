"""Discs against the Cramer-Rao bound, by tilt, in plain light and in clutter and shadows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np

from benchmarks.effort import Effort
from benchmarks.extraction.detection import finder, fitted, like, opencv, views_of
from benchmarks.tables import Column, Table
from handeye_cli.simulate.bound import centre_bound
from handeye_cli.simulate.render import expose, paint_target
from handeye_cli.simulate.scenery import Scenery

TILTS = (0, 15, 30, 45, 55)
HEADS = (
    Column("light"),
    Column("tilts [deg]"),
    Column("views", "d"),
    Column("bound [px]", ".4f"),
    Column("RMS [px]", ".4f"),
    Column("RMS / bound, median", ".3f"),
    Column("largest", ".2f"),
    Column("above 1.5", "d"),
    Column("sigma / RMS", ".2f"),
    Column("bias [px]", ".5f"),
    Column("rounded [px]", ".5f"),
    Column("ellipses [px]", ".3f"),
    Column("OpenCV [px]", ".3f"),
)
NOTE = """The bound is that of each disc with all else known. Per view the ratio is that of the
RMS error of its discs over the RMS bound, sigma the error that the fit predicts of itself. The
bias is the RMS of the mean errors in some pictures of the same scene with so little noise that it
just undoes the rounding to whole grey levels, less what is left of that noise; `rounded` is the
RMS error in a picture without noise, `ellipses` that of the search alone, whose centres are those
of ellipses."""
PICTURES = 16
DITHER = 0.5
"""Noise in grey levels at which rounding is as good as random."""


def rms(seen, view):
    if seen.reason is not None:
        return np.nan
    return float(np.sqrt(np.mean((seen.pixels - like(seen, view.discs)) ** 2)))


def measure(camera, view):
    """Bound, our RMS error, our sigma, our squared bias, our error without noise, the finder's and
    OpenCV's errors, in pixels.
    """
    bound = float(np.sqrt(np.trace(centre_bound(camera, view), axis1=1, axis2=2).mean() / 2))
    seen = fitted(view.image, camera)
    light = paint_target(camera, view.camera_T_target, view.drawing, appearance=view.appearance)
    clean = fitted(expose(light, 0.0, None), camera)
    others = [rms(detect(view.image, camera), view) for detect in (finder, opencv)]
    bias = squared_bias(camera, view, light)
    return [bound, rms(seen, view), seen.sigma_px or np.nan, bias, rms(clean, view), *others]


def squared_bias(camera, view, light):
    """Mean square of the discs' mean errors in dithered pictures, less that of chance."""
    rng = np.random.default_rng(int(1e6 * view.tilt))
    seen = [fitted(expose(light, DITHER, rng), camera) for _ in range(PICTURES)]
    if any(each.reason is not None or len(each.ids) < len(view.discs) for each in seen):
        return np.nan
    errors = np.array([each.pixels - like(each, view.discs) for each in seen])
    chance = errors.var(axis=0, ddof=1) / PICTURES
    return float(np.mean(errors.mean(axis=0) ** 2 - chance))


def in_plain_light(camera, view):
    """The same view without clutter or shadow: only the slope of the light stays."""
    light = paint_target(camera, view.camera_T_target, view.drawing, appearance=view.appearance)
    rng = np.random.default_rng(int(1e6 * view.tilt))
    image = expose(light, view.appearance.noise, rng)
    return replace(view, image=image, scenery=Scenery())


def row(name, low, high, table):
    bound, ours, sigma, bias, rounded, rough, cv = table.T
    ratio = ours / bound
    return (
        name,
        f"{low} - {high}",
        len(table),
        np.median(bound),
        np.median(ours),
        np.nanmedian(ratio),
        np.nanmax(ratio),
        int(np.sum(ratio > 1.5)),
        np.nanmedian(sigma / ours),
        np.sqrt(max(np.nanmean(bias), 0.0)),
        np.sqrt(np.nanmean(rounded**2)),
        np.nanmedian(rough),
        np.nanmedian(cv) if np.isfinite(cv).any() else np.nan,
    )


def tables(effort: Effort) -> Iterator[Table]:
    cv2.setNumThreads(1)
    size = effort.sizes.split(",")[0]
    views = list(views_of(size, effort.views, effort.seed))
    tilts = np.degrees([view.tilt for _, view in views])
    rows = []
    for name, change in (("plain", in_plain_light), ("cluttered", lambda _, view: view)):
        table = np.array([measure(camera, change(camera, view)) for camera, view in views])
        for low, high in [*pairwise(TILTS), (TILTS[0], TILTS[-1])]:
            chosen = (tilts >= low) & (tilts <= high)
            if np.isfinite(table[chosen, 1]).any():
                rows.append(row(name, low, high, table[chosen]))
    title = f"Centres of discs against the Cramer-Rao bound, {size}"
    yield Table("extraction_bound", title, HEADS, rows, NOTE)
