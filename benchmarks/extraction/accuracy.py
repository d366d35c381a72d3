"""Discs against the Cramer-Rao bound, by tilt, in plain light and in clutter and shadows.

The bound is that of each disc with all else known (handeye_cli.simulate.bound). Per view the ratio
is that of the RMS error of its discs over the RMS bound. The bias is the RMS of the mean errors in
some pictures of the same scene with so little noise that it just undoes the rounding to whole grey
levels, less what is left of that noise; `rounded` is the RMS error in a picture without noise.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from extraction.detection import finder, fitted, like, opencv, views_of
from handeye_cli.simulate.bound import centre_bound
from handeye_cli.simulate.render import expose, paint_target
from handeye_cli.simulate.scenery import Scenery

TILTS = (0, 15, 30, 45, 55)
HEAD = (
    "light     tilts [deg]  views  bound [px]  RMS [px]  ratio (50 %)  (max)  > 1.5  sigma / RMS"
    "  bias [px]  rounded  ellipses  OpenCV"
)
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


def row(name, low, high, table) -> str:
    bound, ours, sigma, bias, rounded, rough, cv = table.T
    ratio = ours / bound
    return (
        f"{name:9} {low:5d} - {high:<5d} {len(table):5d} {np.median(bound):11.4f} "
        f"{np.median(ours):9.4f} {np.nanmedian(ratio):13.3f} {np.nanmax(ratio):6.2f} "
        f"{np.sum(ratio > 1.5):6d} {np.nanmedian(sigma / ours):12.2f} "
        f"{np.sqrt(max(np.nanmean(bias), 0.0)):10.5f} {np.sqrt(np.nanmean(rounded**2)):8.5f} "
        f"{np.nanmedian(rough):9.3f} {np.nanmedian(cv):7.3f}"
    )


def report(options) -> None:
    print("Centres of discs against the Cramer-Rao bound, " + options.sizes.split(",")[0])
    print(HEAD)
    views = list(views_of(options.sizes.split(",")[0], options.views, options.seed))
    tilts = np.degrees([view.tilt for _, view in views])
    for name, change in (("plain", in_plain_light), ("cluttered", lambda _, view: view)):
        table = np.array([measure(camera, change(camera, view)) for camera, view in views])
        for low, high in [*pairwise(TILTS), (TILTS[0], TILTS[-1])]:
            chosen = (tilts >= low) & (tilts <= high)
            if chosen.any():
                print(row(name, low, high, table[chosen]), flush=True)
