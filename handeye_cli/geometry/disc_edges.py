"""How far pixels are from the edges of discs, to second order, across the edge in the image."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from handeye_cli.geometry.blurred_edge import normal_distribution
from handeye_cli.geometry.disc_conics import Conics, moved_to, slopes_of
from handeye_cli.geometry.disc_pixels import EdgePixels, FloatArray, SingleArray
from handeye_cli.geometry.sensor_limits import IntArray

_NEIGHBOURS = 4
_FAR = 3.2
"""Blurs beyond which the edge of another disc is not noticed."""
_UPPER, _TWICE = [0, 1, 2, 4, 5, 8], np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0])
"""Where the coefficients of a square are among the products of those of 1, u, v; and how often."""
_LEAST = np.float32(1e-9)
"""Least square of a slope, as roots are taken."""


@dataclass(frozen=True)
class Edges(ABC):
    """Pixels around the edges of discs, and how much of each the discs cover.

    Attributes:
        weight: (n, m) 1 for a pixel that takes part, else 0.
        grey: (n, m) grey levels, times the weight.
        terms: (6, n, m) what the light may consist of: monomials 1, u, v, uu, uv, vv of the offset,
            times the share of the light that a shadow leaves.
        at_limits: (k,) pixels of weight that are black or white, counted row by row.
    """

    weight: SingleArray
    grey: SingleArray
    terms: SingleArray
    at_limits: IntArray

    @cached_property
    def count(self) -> FloatArray:
        """(n,) pixels that take part."""
        # single precision counts so few pixels
        return np.asarray(np.sum(self.weight, axis=1), dtype=float)

    @property
    def clipped(self) -> bool:
        """Whether light beyond the limits of the sensor may be among them."""
        return len(self.at_limits) > 0

    @abstractmethod
    def covered(self, shape: SingleArray, factor: SingleArray, out: SingleArray) -> SingleArray:
        """Return the (n, m) shares of the pixels that discs cover, all together.

        Args:
            shape: (n, 4) shift along the plate's axes and growth, in radii, and blur, pixels.
            factor: (n, m) what the derivatives are multiplied with.
            out: (4, n, m) takes the derivatives of the shares by a disc's own shape.
        """

    def linear(self, shape: SingleArray) -> LinearEdges:
        """Return the same, linearised at a (n, 4) shape of the discs, as `covered` has it."""
        slopes = np.empty((4, *self.grey.shape), np.float32)
        share = self.covered(shape, np.ones_like(self.grey), slopes)
        return LinearEdges(self.weight, self.grey, self.terms, self.at_limits, share, slopes, shape)


@dataclass(frozen=True)
class LinearEdges(Edges):
    """Pixels of which discs are known to cover a share that changes linearly with their shape.

    Attributes:
        share: (n, m) that is covered of the pixels.
        slopes: (4, n, m) its derivatives by the shape.
        at: (n, 4) the shape.
        together: Returns the sums of (n, m) changes by all discs that see a pixel, if others do.
    """

    share: SingleArray
    slopes: SingleArray
    at: SingleArray
    together: Callable[[SingleArray], SingleArray] | None = None

    def every(self, step: int) -> LinearEdges:
        """Return the same with one pixel out of so many, as the sensor would see it unclipped."""
        kept = (self.weight, self.grey, self.terms, self.share, self.slopes)
        weight, grey, terms, share, slopes = (each[..., ::step] for each in kept)
        return LinearEdges(weight, grey, terms, self.at_limits[:0], share, slopes, self.at)

    def covered(self, shape: SingleArray, factor: SingleArray, out: SingleArray) -> SingleArray:
        """See `Edges.covered`."""
        np.multiply(self.slopes, factor, out=out)
        change = combined(shape - self.at, self.slopes)
        return self.share + (change if self.together is None else self.together(change))


@dataclass(frozen=True)
class LargeDiscs(Edges):
    """Pixels with their distances from the edge, linearised in shift and growth.

    Attributes:
        distance: (k, n, m) from the edge, pixels, positive inside, and from that of the nearest
            other disc, if any is near.
        by_shift: (3, n, m) derivatives of the distance by shift and growth, in radii.
    """

    distance: SingleArray
    by_shift: SingleArray

    def every(self, step: int) -> LargeDiscs:
        """Return the same with one pixel out of so many, as the sensor would see it unclipped."""
        kept = (self.weight, self.grey, self.terms, self.distance, self.by_shift)
        weight, grey, terms, distance, by_shift = (each[..., ::step] for each in kept)
        return LargeDiscs(weight, grey, terms, self.at_limits[:0], distance, by_shift)

    def covered(self, shape: SingleArray, factor: SingleArray, out: SingleArray) -> SingleArray:
        """See `Edges.covered`."""
        blur = shape[:, 3, None]
        # in place from here on, as time goes into memory
        blurs = self.distance / blur
        blurs[0] += combined(shape[:, :3] / blur, self.by_shift)
        covered, density = normal_distribution(blurs)
        for other in covered[1:]:
            covered[0] += other
        blurs, by_distance = blurs[0], density[0]
        by_distance *= factor
        by_distance /= blur
        np.multiply(self.by_shift, by_distance, out=out[:3])
        blurs *= by_distance
        np.negative(blurs, out=out[3])
        return np.asarray(covered[0])


def combined(factors: SingleArray, terms: SingleArray) -> SingleArray:
    """Return the (n, m) sums of (k, n, m) terms with (n, k) factors."""
    return np.asarray(np.matmul(factors[:, None], terms.swapaxes(0, 1))[:, 0])


@dataclass(frozen=True)
class Others:
    """The other discs next to each of n discs, as they lie on the plate.

    Attributes:
        square: (n, 2, k, 6) coefficients of 1, u, v, uu, uv, vv of the squared distance from the
            centre in radii, and of the square of half its slope, for pixels from the image of the
            disc's own centre; k at most 4.
        gap: Smallest distance between two edges, pixels.
    """

    square: FloatArray
    gap: float


def others_of(discs: FloatArray, places: FloatArray, conics: Conics) -> Others:
    """Look for the discs next to each.

    Args:
        discs: (n, 3) centre (x, y) on the plate and radius of each disc.
        places: (n, 2) where the map of the plate has the images of the centres.
        conics: Outlines around where the discs are seen.
    """
    index, apart = _beside(np.ascontiguousarray(discs).tobytes())
    seen_from = conics.centre - conics.origin - places
    square = np.stack([conics.level, _steepness(conics.level)], axis=1)
    square[:, 0, 0] += 1.0
    square = moved_to(square[index].swapaxes(1, 2), (places[:, None] + seen_from[index])[:, None])
    return Others(square, float(np.min(apart * conics.ellipses.half_axes[1])))


@lru_cache(maxsize=64)
def _beside(plate: bytes) -> tuple[IntArray, FloatArray]:
    """Return which (n, k) discs are next to each, and how far off, in radii, the nearest edge is.

    All images of a plate ask for them. The distances are (n,).
    """
    x, y, radius = np.frombuffer(plate).reshape(-1, 3).T
    apart = np.hypot(x[:, None] - x, y[:, None] - y) - radius
    np.fill_diagonal(apart, np.inf)
    count = min(_NEIGHBOURS, len(x) - 1)
    index = np.argpartition(apart, count - 1, axis=1)[:, :count]
    return index, np.min(apart, axis=1) / radius - 1.0


def measure(
    conics: Conics,
    pixels: EdgePixels,
    others: Others,
    growth: float,
    *,
    blur: float,
    band: float,
) -> LargeDiscs:
    """Measure pixels against the edges of discs.

    Args:
        conics: Outlines of the discs.
        pixels: The pixels.
        others: The discs next to them.
        growth: By how much all have grown since the others were looked for, in radii.
        blur: Standard deviation of the edges, pixels.
        band: Pixels farther from the edge take no part.
    """
    distance, by_shift = _distances(conics, pixels.terms, blur)
    weight = pixels.weight * (np.abs(distance) < band)
    distances = distance[None]
    if others.gap < band + _FAR * blur:
        square = moved_to(others.square, (conics.origin - conics.centre)[:, None, None])
        distances = np.stack([distance, _nearest(square, 1.0 + growth, pixels.terms)])
    at_limits = pixels.at_limits[weight.ravel()[pixels.at_limits] > 0.0]
    return LargeDiscs(weight, pixels.grey * weight, pixels.terms, at_limits, distances, by_shift)


def _distances(conics: Conics, terms: SingleArray, blur: float) -> tuple[SingleArray, SingleArray]:
    """Return (n, m) distances from the edges and their (3, n, m) derivatives, as `Edges` has them.

    Along the line of steepest rise the level is a quadratic of the distance.
    """
    slopes = slopes_of(conics.level)
    turn = slopes[..., 1:]
    rows = np.zeros((len(slopes), 7, 6))
    rows[:, 0], rows[:, 1:3, :3], rows[:, 3:5, :3] = conics.level, slopes, turn @ slopes
    rows[:, 5:] = conics.rising
    values = _values(rows, terms)
    # in place from here on, as time goes into memory
    level, rise, pull, falling = values[0], values[1:3], values[3:5], values[5:]
    pull *= rise
    rise *= rise
    steep = rise[0] + rise[1]
    bend = pull[0] + pull[1]
    bend /= steep
    slope = np.sqrt(steep)
    level *= -2.0
    steep += bend * level
    np.maximum(steep, _LEAST, out=steep)
    slope_at_edge = np.sqrt(steep, out=steep)
    distance = level / (slope + slope_at_edge)
    # a blurred round edge is half covered a little inside of itself
    around = (turn[:, 0, 0] + turn[:, 1, 1]).astype(np.float32)[:, None]
    curvature = np.subtract(around, bend, out=bend)
    curvature /= slope_at_edge
    curvature *= np.float32(0.5 * blur * blur)
    distance -= curvature
    by_shift = np.empty((3, *distance.shape), np.float32)
    np.divide(falling, slope, out=by_shift[:2])
    np.sqrt(by_shift[0] * by_shift[0] + by_shift[1] * by_shift[1], out=by_shift[2])
    return distance, by_shift


def _values(rows: FloatArray, terms: SingleArray) -> SingleArray:
    """Return the (k, n, m) values of (n, k, 6) quadratics."""
    out = np.empty((rows.shape[1], *terms.shape[1:]), np.float32)
    np.matmul(rows.astype(np.float32), terms.swapaxes(0, 1), out=out.swapaxes(0, 1))
    return out


def _steepness(level: FloatArray) -> FloatArray:
    """Return the (n, 6) coefficients of a quarter of the squared slope of (n, 6) quadratics."""
    slopes = 0.5 * slopes_of(level)
    products = (slopes.swapaxes(1, 2) @ slopes).reshape(-1, 9)
    return np.asarray(products[:, _UPPER] * _TWICE)


def _nearest(square: FloatArray, radius: float, terms: SingleArray) -> SingleArray:
    """Return the (n, m) distances from the nearest edges, positive inside, to first order.

    Args:
        square: (n, 2, k, 6) coefficients of k discs, as `Others` has them.
        radius: Where the edges are.
        terms: (6, n, m) pixels.
    """
    values = _values(square.reshape(len(square), -1, 6), terms)
    np.maximum(values, _LEAST, out=values)
    squared, steepness = values[: len(values) // 2], values[len(values) // 2 :]
    distance = np.sqrt(squared)
    distance *= np.float32(radius)
    distance -= squared
    distance /= np.sqrt(steepness, out=steepness)
    return np.asarray(distance.max(axis=0))
