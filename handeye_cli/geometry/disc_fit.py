"""Centres of discs by maximum likelihood: the blurred edge of each disc fitted to its pixels.

The image of a disc's centre is not the centre of the ellipse it is imaged as. So the edge is
modelled on the plate, where it is a circle, and carried into the image by the map from plate to
pixels: perspective and lens distortion within each disc are part of the model.

A first round looks at a few pixels along spokes, and finds out about the blur and the light. Then
all pixels of a band around the discs' edges take part. A slope of the light looks much like a
shift; it is tied to the light's course over the plate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_conics import Conics, conics_of, images_of
from handeye_cli.geometry.disc_edges import measure, others_of
from handeye_cli.geometry.disc_paper import Patchwork, paper_between
from handeye_cli.geometry.disc_pixels import FloatArray, band_pixels, spoke_pixels
from handeye_cli.geometry.disc_steps import (
    BLUR,
    GROWTH,
    INK,
    KEPT_LIGHT,
    KEPT_SHIFT,
    LIGHT,
    SHIFT,
    Progress,
    first_state,
    settled,
)
from handeye_cli.geometry.light_slopes import Course, Light, course_of_light, typical
from handeye_cli.geometry.sensor_limits import FIRST_NOISE

_FIRST_BLUR = 0.8
_FIRST_BAND = 4.0
"""What the first round takes the blur for, and a distance from the edge, both in pixels."""
_BAND_BLURS = 2.4
_WIDE_BLURS = 3.2
_BAND_LIMITS = (1.6, 9.0)
"""Then pixels within this multiple of the blur take part, more where shadows fall for they tell
the course of the light; and the band's limits."""
_MISSES = 1.5
"""Mean square residual over the noise that chance does not explain."""


@dataclass(frozen=True)
class DiscFit:
    """Fitted discs of one image.

    Attributes:
        pixels: (n, 2) images of the discs' centres.
        covariance: (n, 2, 2) of these from the image noise, square pixels.
        noise: Standard deviation of a grey level, from the residuals.
        growth: (n,) fitted radius over the nominal one, minus 1.
        blur: (n,) standard deviation of the edge, pixels.
        contrast: (n,) grey levels from ink to paper; negative for light discs.
        misfit: (n,) mean square residual of each disc over the median of all.
    """

    pixels: FloatArray
    covariance: FloatArray
    noise: float
    growth: FloatArray
    blur: FloatArray
    contrast: FloatArray
    misfit: FloatArray


def fit_discs(
    image: NDArray[np.uint8], discs: FloatArray, to_pixel: PlateToPixel, start: FloatArray
) -> DiscFit:
    """Fit all discs of a plate in one image.

    Args:
        image: (height, width) grey image.
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        start: (n, 2) first guess of the centres in the image, good to about a pixel.
    """
    images = images_of(discs, to_pixel)
    places = images[:, -1]
    missed = (start - places)[:, None]
    conics = conics_of(images + missed)
    others = others_of(discs, places, conics)
    pixels = spoke_pixels(image, conics)
    edges = measure(conics, pixels, others, 0.0, blur=_FIRST_BLUR, band=_FIRST_BAND)
    first = settled(edges, first_state(edges, _FIRST_BLUR), conics.by_shift, FIRST_NOISE)
    blur, growth = first.blur, typical(first.state[:, GROWTH])
    scale = float(np.min(conics.ellipses.half_axes[1] / discs[:, 2]))
    paper = paper_between(image, discs, to_pixel, scale, _BAND_BLURS * blur)
    prior = _light_prior(first, start, paper)
    moved = _moved(discs, first.state)
    conics = conics_of(images_of(moved, to_pixel) + missed)
    band = _band(blur, prior)
    pixels = band_pixels(image, conics, band)
    edges = measure(conics, pixels, others, growth, blur=blur, band=band)
    state = np.concatenate([np.zeros((len(discs), BLUR)), first.state[:, BLUR:]], axis=1)
    last = settled(edges, state, conics.by_shift, math.sqrt(first.noise), prior)
    if edges.clipped:
        # light beyond the limits shows in the edges alone, which now are known better
        prior = _light_prior(last, start, paper)
        last = settled(edges, last.state, conics.by_shift, math.sqrt(last.noise), prior)
    after = _moved(moved, last.state)
    centres = to_pixel(after[:, :2]) + missed[:, 0]
    return _result(centres, after[:, 2] / discs[:, 2] - 1.0, last, conics)


def _band(blur: float, prior: Course) -> float:
    """Return how far from the edges pixels take part in the end."""
    wide = _WIDE_BLURS if prior.bent else _BAND_BLURS
    return min(max(wide * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])


def _moved(discs: FloatArray, state: FloatArray) -> FloatArray:
    """Return the (n, 3) discs shifted and grown."""
    radius = discs[:, 2:]
    shifted = discs[:, :2] + radius * state[:, SHIFT]
    return np.concatenate([shifted, radius * (1.0 + state[:, GROWTH, None])], axis=1)


def _result(centres: FloatArray, growth: FloatArray, last: Progress, conics: Conics) -> DiscFit:
    state, relative = last.state, last.relative
    # where the model misses something the centre is less sure than the noise alone leaves it
    variance = last.noise * np.where(relative > _MISSES * last.noise, relative / last.noise, 1.0)
    spread = conics.by_shift @ last.spread[:, SHIFT, KEPT_SHIFT]
    return DiscFit(
        pixels=centres,
        covariance=variance[:, None, None] * spread @ np.swapaxes(conics.by_shift, -1, -2),
        noise=math.sqrt(last.noise),
        growth=growth,
        blur=state[:, BLUR],
        contrast=state[:, LIGHT] * (1.0 - state[:, INK]),
        misfit=relative / max(typical(relative), 1e-300),
    )


def _light_prior(first: Progress, start: FloatArray, paper: Patchwork) -> Course:
    """Return how the light should go over each disc, per pixel.

    Its variances are in units of that of a grey level.
    """
    sound, noise = first.sound, first.noise
    spread = noise * first.spread[sound, LIGHT, KEPT_LIGHT]
    light = Light(
        np.concatenate([start[sound], paper.places]),
        np.concatenate([first.state[sound, LIGHT], paper.level]),
        np.concatenate([spread, np.full(len(paper.level), noise / paper.count)]),
        np.repeat([True, False], [int(sound.sum()), len(paper.level)]),
    )
    course = course_of_light(light, start)
    return Course(course.mean, course.variance / noise)
