"""How the light goes over the marks of a plate, by its levels all over the plate.

A slope of the light across the edges of a mark looks much like a shift of the mark. The levels on
the plate are known far better than the slopes at each mark, and light mostly changes slowly: a
quadratic over the plate says what the slopes are. Where shadows fall, a Gaussian process says what
they may be, and by how much the light may bend within a mark.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

POWERS = np.array([1.0, 1.0, 2.0, 2.0, 2.0])
"""Of one over a length in the coefficients of u, v, uu, uv, vv."""
_LEAST = 1e-4
"""Least standard deviation of a slope over a pitch, in levels."""
_FEWEST = 2
_PLANE_TERMS, _QUADRATIC_TERMS = 4, 7
_LOOSELY = 10.0
"""Standard deviation, in levels, to which terms are known beforehand, so that none is free."""
_FITS = 2.0
"""Standard deviations by which the chi-square of a polynomial that fits may be too large."""
_LENGTHS = np.array([0.5, 0.8, 1.2, 1.8, 2.7, 4.0])
"""Pitches over which the light may change."""
_AMOUNTS = np.array([0.02, 0.07, 0.25])
_TYPICAL = 0.07
"""By how much, in levels, and what is taken to find over what pitches."""
_PLANE = 0.1
"""Variance of an even slope over a pitch, in squared levels."""
_APART = 0.02
"""Standard deviation of what fitted levels have in common, in levels."""
_NEAR = 0.8
"""Pitches over which levels are told to be foretold alike, a standard deviation."""
_CALM = 0.3
"""Least factor to the variances where the levels are foretold well."""


@dataclass(frozen=True)
class Light:
    """The levels of the light at n places.

    Attributes:
        places: (n, 2) in the image, in any unit of length.
        level: (n,) of the light.
        variance: (n,) of the levels.
        fitted: (n,) whether a level is that of a fit. Fits may differ from plain means alike.
    """

    places: FloatArray
    level: FloatArray
    variance: FloatArray
    fitted: BoolArray


@dataclass(frozen=True)
class Course:
    """What the light should be over each of m marks, but for its level there.

    Attributes:
        mean: (m, 2) coefficients of u, v or (m, 5) of u, v, uu, uv, vv from the mark.
        variance: The variances of the true ones about them.
    """

    mean: FloatArray
    variance: FloatArray

    @property
    def bent(self) -> bool:
        """Whether the light bends within a mark."""
        return bool(self.mean.shape[1] > 2)

    def scaled(self, level: float, length: float) -> Course:
        """Return the same for light and lengths in smaller units, so many times."""
        factor = level / length ** POWERS[: self.mean.shape[1]]
        return Course(self.mean * factor, self.variance * factor**2)


def course_of_light(light: Light, marks: FloatArray) -> Course:
    """Return the course of the light over (m, 2) marks, which bends where shadows fall.

    A single level says nothing of slopes: the light is then taken to be even.
    """
    course = even_course(light, marks)
    return bent_course(light, marks) if course is None else course


def bent_course(light: Light, marks: FloatArray) -> Course:
    """Return the course of light that no polynomial over the plate explains."""
    relative, at, units = _relative(light, marks)
    return _in_units(_process(relative, at), units)


def even_course(light: Light, marks: FloatArray) -> Course | None:
    """Return the course of light that is even or a little bent over the plate, else None."""
    if len(light.level) < _FEWEST:
        return Course(np.zeros_like(marks), np.full_like(marks, _LEAST**2))
    relative, at, units = _relative(light, marks)
    course = _polynomial(relative, at)
    return None if course is None else _in_units(course, units)


def _relative(light: Light, marks: FloatArray) -> tuple[Light, FloatArray, tuple[float, float]]:
    """Return light and (m, 2) marks in units of a level and a pitch, and these units."""
    level, middle = typical(light.level), light.places.mean(axis=0)
    pitch = pitch_of(light.places)
    relative = Light(
        (light.places - middle) / pitch,
        light.level / level,
        light.variance / level**2,
        light.fitted,
    )
    return relative, (marks - middle) / pitch, (level, pitch)


def _in_units(course: Course, units: tuple[float, float]) -> Course:
    return Course(course.mean, course.variance + _LEAST**2).scaled(*units)


def typical(values: FloatArray) -> float:
    """Return the upper median of a few dozen values, ten times as fast as NumPy's."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def pitch_of(places: FloatArray) -> float:
    """Return the typical distance of (n, 2) places from their nearest ones."""
    return math.sqrt(typical(np.partition(_squares(places, places), 1, axis=1)[:, 1]))


def _squares(here: FloatArray, there: FloatArray) -> FloatArray:
    """Return the (m, n) squared distances between (m, 2) and (n, 2) places."""
    x, y = here[:, :1] - there[:, 0], here[:, 1:] - there[:, 1]
    return np.asarray(x * x + y * y)


def _polynomial(light: Light, at: FloatArray) -> Course | None:
    """Return the slopes by the plane through the levels or by the quadratic, if one fits."""
    extent = max(float(np.max(np.abs(light.places))), 1e-9)
    x, y = light.places.T / extent
    terms = np.array([np.ones_like(x), x, y, light.fitted, x * x, x * y, y * y, light.level])
    beforehand = np.eye(len(terms))[:-1] / _LOOSELY
    rows = np.concatenate([(terms / np.sqrt(light.variance)).T, beforehand])
    # its last column says how much of the levels each further term explains
    factor: FloatArray = np.asarray(np.linalg.qr(rows, mode="r"))
    for used in (_PLANE_TERMS, _QUADRATIC_TERMS):
        freedom = len(x) - used
        if freedom < used:
            return None
        chi_square = float(np.sum(factor[used:, -1] ** 2))
        if chi_square <= freedom + _FITS * math.sqrt(2.0 * freedom):
            slopes = _slopes(at / extent)[:, :, :used]
            halves = slopes @ np.linalg.inv(factor[:used, :used])
            course = Course(halves @ factor[:used, -1], np.sum(halves * halves, axis=-1))
            return course.scaled(1.0, extent)
    return None


def _slopes(at: FloatArray) -> FloatArray:
    """Return the (m, 2, 7) derivatives of the quadratic's terms at (m, 2) places."""
    x, y = at.T
    slopes = np.zeros((len(at), 2, _QUADRATIC_TERMS))
    slopes[:, 0, 1] = slopes[:, 1, 2] = 1.0
    slopes[:, 0, 4], slopes[:, 1, 6] = 2.0 * x, 2.0 * y
    slopes[:, 0, 5], slopes[:, 1, 5] = y, x
    return slopes


def _process(light: Light, at: FloatArray) -> Course:
    """Return slopes and bends of a Gaussian process through the levels.

    Over what distance the light changes, and by how much, is what makes the levels most likely. It
    changes more at a shadow's edge than elsewhere: the variances follow how well the levels around
    are foretold by all others.
    """
    places, right = light.places, light.level - 1.0
    common = _PLANE * (1.0 + places @ places.T) + _APART**2 * np.outer(light.fitted, light.fitted)
    common += np.diag(light.variance)
    bells = _bell(_squares(places, places) / (_LENGTHS**2)[:, None, None])
    likeliest = int(np.argmin(_unlikely(_TYPICAL**2 * bells + common, right)))
    length, bell = float(_LENGTHS[likeliest]), bells[likeliest]
    levels = (_AMOUNTS**2)[:, None, None] * bell + common
    likeliest = int(np.argmin(_unlikely(levels, right)))
    amount = float(_AMOUNTS[likeliest])
    inverse = np.linalg.inv(levels[likeliest])
    shared = _shared(at, places, amount, length)
    steep, bent = (amount / length) ** 2, (amount / length**2) ** 2
    before = [steep + _PLANE, steep + _PLANE, 0.75 * bent, bent, 0.75 * bent]
    variance = np.maximum(before - np.sum((shared @ inverse) * shared, axis=-1), 0.0)
    near = _bell(_squares(at, places) / _NEAR**2)
    foretold = (inverse @ right) ** 2 / np.diag(inverse)
    local = near @ foretold / np.maximum(near.sum(axis=1), 1e-9)
    return Course(shared @ (inverse @ right), variance * np.maximum(local, _CALM)[:, None])


def _bell(square: FloatArray) -> FloatArray:
    """Return exp(-square / 2), but nothing so small that processors are slow with it."""
    return np.exp(-0.5 * np.minimum(square, 200.0))


def _unlikely(covariance: FloatArray, right: FloatArray) -> FloatArray:
    """Return (g,) minus twice the logarithm of how likely the levels are, but for a constant."""
    g, n, _ = covariance.shape
    # the levels as a last row are solved with the factor on the way; the corner has no part in it
    bordered = np.empty((g, n + 1, n + 1))
    bordered[:, :n, :n], bordered[:, n, :n], bordered[:, :n, n] = covariance, right, right
    bordered[:, n, n] = np.inf
    factor = np.linalg.cholesky(bordered)
    half, diagonal = factor[:, n, :n], np.einsum("gii->gi", factor)[:, :n]
    return np.asarray(np.sum(half**2, axis=1) + 2.0 * np.sum(np.log(diagonal), axis=1))


def _shared(at: FloatArray, places: FloatArray, amount: float, length: float) -> FloatArray:
    """Return (m, 5, n) covariances of the course's coefficients with the levels."""
    x, y = (at[:, :1] - places[:, 0]) / length, (at[:, 1:] - places[:, 1]) / length
    xx, yy = x * x, y * y
    bell = amount**2 * _bell(xx + yy)
    out = np.empty((len(at), len(POWERS), len(places)))
    for k, factor in enumerate([-x, -y, 0.5 * (xx - 1.0), x * y, 0.5 * (yy - 1.0)]):
        np.multiply(bell, factor, out=out[:, k])
    out /= length ** POWERS[:, None]
    out[:, :2] += _PLANE * places.T
    return np.asarray(out)
