"""The pixels around the edges of discs, and where they lie on the plate.

Near each disc the map from pixels back to the plate is a cubic polynomial, so neither perspective
nor lens distortion has to be inverted pixel by pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

NEIGHBOURS = 4
_POWERS = [(i, j) for i in range(4) for j in range(4 - i)]
"""Exponents of the cubic's monomials."""


@dataclass(frozen=True)
class Windows:
    """Square windows around the discs, all of one size.

    Attributes:
        grey: (n, k) grey levels of the pixels.
        inside: (n, k) whether the pixel lies in the image.
        offset: (k, 2) of the pixels from the window's middle, in half widths.
        half: Half width in pixels.
        cubic: (n, 2, 10) from the offset to the plate, in radii from the disc's centre.
        scale: (n,) a pixel in radii, the mean over the disc.
        others: (n, 4, 3) the nearest discs: centre from this one's, and radius, in radii.
        gap: Smallest distance between the edges of two discs, pixels.
    """

    grey: NDArray[np.uint8]
    inside: NDArray[np.bool_]
    offset: SingleArray
    half: int
    cubic: SingleArray
    scale: SingleArray
    others: SingleArray
    gap: float


@dataclass(frozen=True)
class EdgePixels:
    """The m pixels at most near the edge of each disc; components come before the pixels.

    Attributes:
        grey: (n, m) grey levels.
        weight: (n, m) 1 for a pixel, 0 for padding.
        offset: (n, 2, m) from the window's middle, in half widths.
        plate: (n, 2, m) on the plate, in radii from the disc's first centre.
        slopes: (n, 4, m) derivatives of the plate's x and y by the pixel's u, then by its v.
    """

    grey: SingleArray
    weight: SingleArray
    offset: SingleArray
    plate: SingleArray
    slopes: SingleArray

    def thinned(self, step: int) -> EdgePixels:
        """Return every `step`-th pixel."""
        arrays = (self.grey, self.weight, self.offset, self.plate, self.slopes)
        return EdgePixels(*(np.ascontiguousarray(array[..., ::step]) for array in arrays))


def forward_jacobian(to_pixel: PlateToPixel, at: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the (n, 2, 2) derivatives of the map, by central differences over a tenth radius."""
    step = 0.1 * radius[:, None, None] * np.eye(2)
    ends = to_pixel(at[:, None] + step) - to_pixel(at[:, None] - step)
    return np.asarray(np.swapaxes(ends, -1, -2) / (0.2 * radius[:, None, None]))


def cut_windows(
    image: NDArray[np.uint8],
    discs: FloatArray,
    to_pixel: PlateToPixel,
    start: FloatArray,
    band: float,
) -> Windows:
    """Cut out a window around each disc.

    Args:
        image: (height, width) grey image.
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        start: (n, 2) where the centres are in the image; each disc's map is moved there.
        band: How far beyond the discs the windows reach, pixels.
    """
    radius = discs[:, 2]
    jacobian = radius[:, None, None] * forward_jacobian(to_pixel, discs[:, :2], radius)
    axes = np.linalg.svd(jacobian, compute_uv=False)
    half = math.ceil(float(np.max(axes)) + band)
    middle = np.rint(start).astype(np.int64)
    line = np.arange(-half, half + 1)
    u, v = (each.ravel() for each in np.meshgrid(line, line))
    columns, rows = middle[:, :1] + u, middle[:, 1:] + v
    inside = (rows >= 0) & (rows < image.shape[0]) & (columns >= 0) & (columns < image.shape[1])
    place = np.where(inside, rows * image.shape[1] + columns, 0)
    reach = (1.2 + band / axes[:, 1]).astype(float)
    missed = np.asarray(start - to_pixel(discs[:, :2]), dtype=float)
    others = _nearest_discs(discs)
    apart = np.linalg.norm(others[..., :2], axis=-1) - others[..., 2] - 1.0
    return Windows(
        grey=image.ravel()[place],
        inside=inside,
        offset=(np.stack([u, v], axis=-1) / half).astype(np.float32),
        half=half,
        cubic=_inverse_cubic(discs, to_pixel, missed - middle, reach, half),
        scale=(1.0 / np.sqrt(axes[:, 0] * axes[:, 1])).astype(np.float32),
        others=others.astype(np.float32),
        gap=float(np.min(np.min(apart, axis=1) * axes[:, 1])),
    )


def _inverse_cubic(
    discs: FloatArray, to_pixel: PlateToPixel, shift: FloatArray, reach: FloatArray, half: int
) -> SingleArray:
    """Return the (n, 2, 10) cubics from a window's offsets to the plate, in radii."""
    ticks = np.linspace(-1.0, 1.0, 7)
    grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    local = reach[:, None, None] * grid
    pixels = to_pixel(discs[:, None, :2] + discs[:, None, 2:] * local) + shift[:, None]
    terms = _monomials(pixels / half)
    transposed = np.swapaxes(terms, -1, -2)
    cubic = np.linalg.solve(transposed @ terms, transposed @ local)
    return np.swapaxes(cubic, -1, -2).astype(np.float32)


def _monomials(points: NDArray[np.floating]) -> NDArray[np.floating]:
    x, y = points[..., 0], points[..., 1]
    one = np.ones_like(x)
    xs, ys = [one, x, x * x, x * x * x], [one, y, y * y, y * y * y]
    return np.stack([xs[i] * ys[j] for i, j in _POWERS], axis=-1)


def _nearest_discs(discs: FloatArray) -> FloatArray:
    apart = np.linalg.norm(discs[:, None, :2] - discs[None, :, :2], axis=-1)
    nearest = np.argsort(apart, axis=1)[:, 1 : NEIGHBOURS + 1]
    relative = discs[nearest].copy()
    relative[..., :2] -= discs[:, None, :2]
    return np.asarray(relative / discs[:, None, None, 2])


def edge_pixels(windows: Windows, moved: FloatArray, band: float) -> EdgePixels:
    """Select the pixels within a band, in pixels, around the edges of the discs.

    `moved` (n, 3) says by how much the discs are shifted and grown against their nominal place, in
    radii.
    """
    plate = windows.cubic @ _monomials(windows.offset).T
    x = plate[:, 0] - moved[:, :1].astype(np.float32)
    y = plate[:, 1] - moved[:, 1:2].astype(np.float32)
    beside = np.abs(np.sqrt(x * x + y * y) - (1.0 + moved[:, 2:]).astype(np.float32))
    # The scale is a mean over the disc; along its short axis a band of pixels is wider than that.
    near = beside < (1.5 * band) * windows.scale[:, None]
    chosen, weight = _packed(near & windows.inside)
    offset = np.ascontiguousarray(np.moveaxis(windows.offset[chosen], -1, 1))
    return EdgePixels(
        grey=np.take_along_axis(windows.grey, chosen, 1).astype(np.float32),
        weight=weight,
        offset=offset,
        plate=np.take_along_axis(plate, chosen[:, None], 2),
        slopes=_slopes(windows.cubic, offset, windows.half),
    )


def _packed(mask: NDArray[np.bool_]) -> tuple[IntArray, SingleArray]:
    """Return (n, m) indices of each row's true entries, padded with 0, and their weights."""
    row, column = np.nonzero(mask)
    count = np.bincount(row, minlength=len(mask))
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    chosen = np.zeros((len(mask), max(int(count.max()), 1)), dtype=np.int64)
    weight = np.zeros(chosen.shape, dtype=np.float32)
    chosen[row, place], weight[row, place] = column, 1.0
    return chosen, weight


def _slopes(cubic: SingleArray, offset: SingleArray, half: int) -> SingleArray:
    """Return the (n, 4, m) derivatives of the plate's x, y by the pixel's u, then by its v."""
    x, y = offset[:, 0], offset[:, 1]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    lower = {(0, 0): 0, (1, 0): 1, (0, 1): 2, (2, 0): 3, (1, 1): 4, (0, 2): 5}
    matrix = np.zeros((len(cubic), 4, 6), dtype=np.float32)
    for index, (i, j) in enumerate(_POWERS):
        for rows, factor, power in ((slice(0, 2), i, (i - 1, j)), (slice(2, 4), j, (i, j - 1))):
            if factor:
                matrix[:, rows, lower[power]] += (factor / half) * cubic[:, :, index]
    return matrix @ terms
