"""Discs in an image that are not much larger than its blur.

There an edge is nowhere alone: how much of a pixel's light a disc takes is the integral of the blur
over all of its image A. By the divergence theorem that is an integral along the outline alone,

    S(q) = closed integral of (1 - exp(-r^2 / 2 blur^2)) / (2 pi r^2) (p - q) n ds

with r the distance of the pixel q from the outline's points p, and n its outward normal. So are the
derivatives. With points at even angles around the disc the error of the sum falls exponentially.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from handeye_cli.geometry.disc_conics import Conics, local_maps
from handeye_cli.geometry.disc_edges import Edges, LinearEdges
from handeye_cli.geometry.disc_pixels import EdgePixels, FloatArray, SingleArray
from handeye_cli.geometry.sensor_limits import IntArray

_SPACING = 1.5
"""Blurs between points of an outline: the sum is then within 1e-4 of the integral."""
_ROUGHLY = 0.7
"""Share of the points that is enough for a first step."""
_LEAST_LEFT = 0.5
"""Share of a disc's pixels that must be left when strange ones are taken out."""
_FARTHEST = np.float32(-80.0)
"""Least exponent of the blur."""
_LEAST = np.float32(1e-6)
"""Least square of a distance, as something is divided by it."""


@dataclass(frozen=True)
class SmallDiscs(Edges):
    """All pixels in and around small discs, with the images of their discs.

    Attributes:
        held: (n, m) 1 for a pixel, 0 for padding. A pixel without weight may be held.
        places: (n, 4, m) monomials 1, u, v and uu + vv.
        maps: (n, 2, 6) how each disc is imaged, as `local_maps` has it.
        index: (n, m) where the pixels are in a part of the image.
        size: Height and width of that part.
        points: Of each outline.
        room: (2, n, points, m) to calculate in, as getting memory takes time.
    """

    held: SingleArray
    places: SingleArray
    maps: FloatArray
    index: IntArray
    size: tuple[int, int]
    points: int
    room: SingleArray

    @classmethod
    def of(cls, images: FloatArray, conics: Conics, pixels: EdgePixels, blur: float) -> SmallDiscs:
        """Return the discs with the pixels in and around them.

        Args:
            images: (n, 17, 2) of points of the discs, as `images_of` has them.
            conics: Their outlines.
            pixels: All that the discs have to do with.
            blur: Standard deviation of the edges, pixels.
        """
        u, v = pixels.terms[1:3] + conics.origin.T[..., None].astype(np.float32)
        u -= u.min()
        v -= v.min()
        height, width = int(v.max()) + 1, int(u.max()) + 1
        longest = float(conics.ellipses.half_axes[0].max())
        points = math.ceil(2.0 * math.pi * longest / (_SPACING * blur))
        return cls(
            weight=pixels.weight,
            grey=pixels.grey * pixels.weight,
            terms=pixels.terms,
            at_limits=_with_weight(pixels.at_limits, pixels.weight),
            held=pixels.weight,
            places=np.stack([*pixels.terms[:3], pixels.terms[3] + pixels.terms[5]], axis=1),
            maps=local_maps(images - conics.origin[:, None]),
            index=(v * np.float32(width) + u).astype(np.int64),
            size=(height, width),
            room=np.empty((2, len(images), points, u.shape[1]), dtype=np.float32),
            points=points,
        )

    def linear(self, shape: SingleArray) -> LinearEdges:
        """See `Edges.linear`."""
        return replace(super().linear(shape), together=self._everywhere)

    def roughly(self) -> SmallDiscs:
        """Return the same with less points: their sum is within 1e-2 of the integral."""
        points = math.ceil(_ROUGHLY * self.points)
        return replace(self, points=points, room=self.room[:, :, :points])

    def without(self, strange: NDArray[np.bool_]) -> SmallDiscs:
        """Return the same without (n, m) pixels and those next to them.

        A disc of which nothing much would be left keeps its pixels, as it is strange itself.
        """
        seen = self._together(strange.astype(np.float32)).reshape(self.size) > 0.0
        around = sliding_window_view(np.pad(seen, 1), (3, 3)).any(axis=(2, 3))
        weight = self.weight * ~around.ravel()[self.index]
        left = weight.sum(axis=1) > _LEAST_LEFT * self.held.sum(axis=1)
        weight = np.where(left[:, None], weight, self.weight)
        at_limits = _with_weight(self.at_limits, weight)
        return replace(self, weight=weight, grey=self.grey * weight, at_limits=at_limits)

    def _everywhere(self, values: SingleArray) -> SingleArray:
        """Return the (n, m) sums of values over all discs that have to do with each pixel."""
        return np.asarray(self._together(values)[self.index])

    def _together(self, values: SingleArray) -> SingleArray:
        """Return the sums of (n, m) values at each pixel of the part of the image."""
        height, width = self.size
        sums = np.bincount(self.index.ravel(), (values * self.held).ravel(), height * width)
        return sums.astype(np.float32)

    def covered(self, shape: SingleArray, factor: SingleArray, out: SingleArray) -> SingleArray:
        """See `Edges.covered`."""
        blur = shape[:, 3, None, None].astype(float)
        scale = 0.5 / (blur * blur)
        p, by_shape, normal = self._outlines(shape[:, :3].astype(float))
        # the square of the distance, less than nothing, by 1, u, v and uu + vv
        square = _single(-scale * np.concatenate([_dot(p, p), -2.0 * p, np.ones_like(p[:, :1])], 1))
        # its part across the outline, by 1, u and v
        across = np.concatenate([_dot(p, normal), -normal], axis=1)
        by_place = np.concatenate([np.sum(by_shape * normal[:, None], axis=2), across], axis=1)
        by_place = _single(scale / math.pi * by_place)
        across = _single(scale / (2.0 * math.pi) * across)
        # in place from here on, as time goes into memory
        far, near = self.room
        np.matmul(square.swapaxes(1, 2), self.places, out=far)
        # numbers near nothing are slow
        np.maximum(far, _FARTHEST, out=near)
        np.exp(near, out=near)
        sums = by_place @ near
        np.minimum(far, -_LEAST, out=far)
        near -= np.float32(1.0)
        near /= far
        plane = self.places[:, :3]
        np.multiply(sums[:, :3].swapaxes(0, 1), factor, out=out[:3])
        np.einsum("nkm,nkm->nm", sums[:, 3:], plane, out=out[3])
        out[3] *= factor / -_single(blur[:, 0])
        return self._everywhere(np.einsum("nkm,nkm->nm", across @ near, plane))

    def _outlines(self, shape: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points of the outlines, derivatives of them by shift and growth, and the normals.

        Args:
            shape: (n, 3) shift and growth, in radii.

        Returns:
            (n, 2, k) pixels, (n, 3, 2, k) derivatives, (n, 2, k) outward normals as long as the
            part of the outline between two points.
        """
        angle = 2.0 * np.pi * np.arange(self.points) / self.points
        circle = np.stack([np.cos(angle), np.sin(angle)])
        grown = 1.0 + shape[:, 2:]
        x, y = shape[:, :1] + grown * circle[0], shape[:, 1:2] + grown * circle[1]
        one, zero = np.ones_like(x), np.zeros_like(x)
        p = self.maps @ np.stack([one, x, y, x * x - y * y, 2 * x * y, x * x + y * y], axis=1)
        by_x = self.maps @ np.stack([zero, one, zero, 2 * x, 2 * y, 2 * x], axis=1)
        by_y = self.maps @ np.stack([zero, zero, one, -2 * y, 2 * x, 2 * y], axis=1)
        by_growth = circle[0] * by_x + circle[1] * by_y
        along = (2.0 * np.pi / self.points) * grown[:, None] * (circle[0] * by_y - circle[1] * by_x)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        return p, np.stack([by_x, by_y, by_growth], axis=1), normal


def _with_weight(at: IntArray, weight: SingleArray) -> IntArray:
    """Return those of the pixels, counted row by row, that take part."""
    return at[weight.ravel()[at] > 0.0]


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return (n, 1, k) products of (n, 2, k) vectors."""
    return np.asarray(np.sum(a * b, axis=1, keepdims=True))


def _single(values: FloatArray) -> SingleArray:
    return values.astype(np.float32)
