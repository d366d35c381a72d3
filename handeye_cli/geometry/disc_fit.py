"""Centres of discs by maximum likelihood: the blurred edge of each disc fitted to its pixels.

The image of a disc's centre is not the centre of the ellipse it is imaged as. So the edge is
modelled on the plate, where it is a circle, and carried into the image by the map from plate to
pixels: perspective and lens distortion within each disc are part of the model.

A first round looks at a few pixels along spokes, and finds out about the blur and the light. Then
all pixels of a band around the discs' edges take part, or all around discs that are not much larger
than their blur. A slope of the light looks much like a shift; it is tied to the light's course over
the plate, and to the edge of a shadow where one falls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.disc_conics import Conics, PlateInView, conics_of, images_of
from handeye_cli.geometry.disc_edges import Others, measure, others_of
from handeye_cli.geometry.disc_paper import paper_between
from handeye_cli.geometry.disc_pixels import FloatArray, area_pixels, band_pixels, spoke_pixels
from handeye_cli.geometry.disc_priors import Surface
from handeye_cli.geometry.disc_steps import (
    BLUR,
    GROWTH,
    INK,
    KEPT_SHIFT,
    LIGHT,
    SHIFT,
    Progress,
    first_state,
    settled,
)
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.sensor_limits import FIRST_NOISE
from handeye_cli.geometry.shadow_fit import Before, settled_in_shadow, shadow_over
from handeye_cli.geometry.small_disc_fit import settled_small
from handeye_cli.geometry.small_discs import SmallDiscs

_FIRST_BLUR = 0.8
_FIRST_BAND = 4.0
"""What the first round takes the blur for, and a distance from the edge, both in pixels."""
_BAND_BLURS = 2.4
_WIDE_BLURS = 3.2
_BAND_LIMITS = (1.6, 9.0)
"""Then pixels within this multiple of the blur take part, more where shadows fall for they tell
the course of the light; and the band's limits."""
_SHARPEST_BEND = 0.35
"""Blurs in the radius of an outline, from which on an edge is not alone."""
_MOST_WORK = 3e5
"""For discs up to which that is allowed for: pixels by blurs along the outline, of all discs."""
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

    @cached_property
    def variance(self) -> FloatArray:
        """(n,) variances of a pixel coordinate, in the mean of both."""
        return np.asarray(self.covariance[:, 0, 0] + self.covariance[:, 1, 1]) / 2.0


def fit_discs(image: NDArray[np.uint8], view: PlateInView, start: FloatArray) -> DiscFit:
    """Fit all discs of a plate in one image.

    Args:
        image: (height, width) grey image.
        view: The discs and the map that tells how each is imaged, nearly where it is.
        start: (n, 2) first guess of the centres in the image, good to about a pixel.
    """
    discs, to_pixel = view.discs, view.to_pixel
    places = view.images[:, -1]
    missed = (start - places)[:, None]
    conics = conics_of(view.images + missed)
    others = others_of(discs, places, conics)
    first = _first_round(image, conics, others)
    scale = float(np.min(conics.ellipses.half_axes[1] / discs[:, 2]))
    paper = paper_between(image, discs, to_pixel, scale, _BAND_BLURS * first.blur)
    surface = Surface(start, paper)
    begun = first.state.copy()
    small = _are_small(conics, first.blur)
    if small:
        begun[:, GROWTH] = typical(begun[:, GROWTH])
    moved = _moved(discs, begun)
    images = images_of(moved, to_pixel) + missed
    conics = conics_of(images)
    begun[:, :BLUR] = 0.0
    if small:
        pixels = area_pixels(image, conics, _WIDE_BLURS * first.blur)
        near = SmallDiscs.of(images, conics, pixels, first.blur)
        last = settled_small(near, begun, conics, first, surface)
    else:
        last = _settled_large(image, (conics, others), begun, first, surface)
    after = _moved(moved, last.state)
    centres = to_pixel(after[:, :2]) + missed[:, 0]
    return _result(centres, after[:, 2] / discs[:, 2] - 1.0, last, conics)


def _first_round(image: NDArray[np.uint8], conics: Conics, others: Others) -> Progress:
    """Return what a few pixels say of discs, of which only outlines are known."""
    pixels = spoke_pixels(image, conics)
    edges = measure(conics, pixels, others, 0.0, blur=_FIRST_BLUR, band=_FIRST_BAND)
    return settled(edges, first_state(edges, _FIRST_BLUR), conics.by_shift, FIRST_NOISE)


def _settled_large(
    image: NDArray[np.uint8],
    outlines: tuple[Conics, Others],
    state: FloatArray,
    first: Progress,
    surface: Surface,
) -> Progress:
    """Take the last steps of discs whose edges are bent little within their blur.

    Args:
        image: (height, width) grey image.
        outlines: Of the discs as they were found, and of those next to them.
        state: (n, p) where to start.
        first: What was found.
        surface: Where more is known of the light.
    """
    conics, others = outlines
    prior, noise = surface.even_prior(first, first.sound), math.sqrt(first.variance)
    band, growth = _band(first.blur, shadowed=prior is None), typical(first.state[:, GROWTH])
    pixels = band_pixels(image, conics, band)
    edges = measure(conics, pixels, others, growth, blur=first.blur, band=band)
    shadow = None
    if prior is None:
        before = Before(first, surface, first.sound, lambda prior, _: prior)
        shadow = shadow_over(edges, before)
        last = settled_in_shadow(edges, conics.origin, state, before, shadow)
        if last is not None:
            return last
    prior = prior or surface.bent_prior(first, first.sound)
    last = settled(edges, state, conics.by_shift, noise, prior)
    if not edges.clipped:
        if not prior.bent or (shadow is not None and not shadow.sharp):
            return last
        # levels that a smooth course explains show very sharp edges, which the first ones do not
        before = Before(last, surface, last.sound, lambda prior, _: prior)
        shadow = shadow_over(edges, before)
        return settled_in_shadow(edges, conics.origin, last.state, before, shadow) or last
    # light beyond the limits shows in the edges alone, which now are known better
    prior = surface.prior(last, last.sound)
    return settled(edges, last.state, conics.by_shift, math.sqrt(last.variance), prior)


def _are_small(conics: Conics, blur: float) -> bool:
    """Return whether outlines are bent so much that their edges are not alone."""
    long, short = conics.ellipses.half_axes
    bend = blur * float(np.max(long / (short * short)))
    wide = _WIDE_BLURS * blur
    work = len(long) * float(np.max((long + wide) * (short + wide) * long)) / blur
    return bend > _SHARPEST_BEND and work < _MOST_WORK


def _band(blur: float, *, shadowed: bool) -> float:
    """Return how far from the edges pixels take part in the end."""
    wide = _WIDE_BLURS if shadowed else _BAND_BLURS
    return min(max(wide * blur, _BAND_LIMITS[0]), _BAND_LIMITS[1])


def _moved(discs: FloatArray, state: FloatArray) -> FloatArray:
    """Return the (n, 3) discs shifted and grown."""
    radius = discs[:, 2:]
    shifted = discs[:, :2] + radius * state[:, SHIFT]
    return np.concatenate([shifted, radius * (1.0 + state[:, GROWTH, None])], axis=1)


def _result(centres: FloatArray, growth: FloatArray, last: Progress, conics: Conics) -> DiscFit:
    state, relative = last.state, last.relative
    # where the model misses something the centre is less sure than the noise alone leaves it
    variance = np.where(relative > _MISSES * last.variance, relative, last.variance)
    spread = conics.by_shift @ last.spread[:, SHIFT, KEPT_SHIFT]
    return DiscFit(
        pixels=centres,
        covariance=variance[:, None, None] * spread @ np.swapaxes(conics.by_shift, -1, -2),
        noise=math.sqrt(last.variance),
        growth=growth,
        blur=state[:, BLUR],
        contrast=state[:, LIGHT] * (1.0 - state[:, INK]),
        misfit=relative / max(typical(relative), 1e-300),
    )
