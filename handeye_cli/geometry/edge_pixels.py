"""The sides of dark squares as they lie in an image, and the pixels beside them.

Each side has coordinates of its own: x runs along the chord between the images of its two corners
and y across it, into the square. In them the side is a flat curve, a polynomial, so neither
perspective nor lens distortion has to be inverted pixel by pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp
from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.sensor_limits import at_limits

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
Real = TypeVar("Real", np.float32, np.float64)
Scalar = TypeVar("Scalar", bound=np.generic)

SIDES = 4
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
_KNOTS = np.linspace(0.0, 1.0, 9)
_CURVE, _DEPTH = 4, 2
"""Degrees of the polynomials in x of a side and of the width of the border behind it."""
_END_BLURS, _LEAST_END = 2.5, 2.0
"""Pixels are this many blurs, and this many pixels, away from the square's other sides."""
_CLEAR_BLURS, _LEAST_BLURS = 2.0, 1.3
"""They stay so many blurs away from the end of the light margin, if that leaves so many."""
_FAR_BLURS = 2.5
"""Beyond this many blurs an edge is not felt."""


@dataclass(frozen=True)
class Squares:
    """Dark squares on a light plate, each with a dark border around cells that may be light.

    Attributes:
        corners: (n, 4, 2) on the plate, metres, in the order top left, top right, bottom right,
            bottom left or a turn of it; side k leads from corner k to the next.
        cells: How many cells are in a row, the border's two included.
        light: (n, 4, cells - 2) whether the cells behind the border are light, along each side.
        margin: Width of the light margin around each square, in cells.
    """

    corners: FloatArray
    cells: int
    light: BoolArray
    margin: float


@dataclass(frozen=True)
class Sides:
    """All m = 4 n sides of n squares, those of a square one after another.

    Attributes:
        origin: (m, 2) the pixel nearest to the first corner.
        first: (m, 2) the first corner from there, pixels.
        along: (m, 2) unit vector to the second corner; across is a quarter turn further.
        length: (m,) between the corners, pixels.
        curve: (m, 5) polynomials of the side's y by x in lengths, constant first.
        depth: (m, 3) polynomials of the border's width in pixels, the same way.
        stops: (m, cells - 1) x where the cells behind the border begin and end, pixels.
        skew: (m,) how much x of the lines between the cells grows with y.
        others: (m, 2, 2) inward normals (x, y) of the side before and of the side after.
    """

    origin: IntArray
    first: FloatArray
    along: FloatArray
    length: FloatArray
    curve: FloatArray
    depth: FloatArray
    stops: FloatArray
    skew: FloatArray
    others: FloatArray


@dataclass(frozen=True)
class Band:
    """The p pixels at most beside each of m sides.

    Attributes:
        grey: (m, p) grey levels.
        weight: (m, p) 1 for a pixel, 0 for padding.
        place: (m, p) along the side, 0 at its first corner and 1 at its second.
        distance: (m, p) from the side, pixels, positive inside.
        behind: (m, p) from the border's inner edge, pixels, positive beyond it.
        cells: (2, m, p) share of light along the row of cells there, and the density of its ends
            times the cosine between them and the edge; None where the border is too wide to see.
    """

    grey: SingleArray
    weight: SingleArray
    place: SingleArray
    distance: SingleArray
    behind: SingleArray
    cells: SingleArray | None

    @cached_property
    def at_limits(self) -> NDArray[np.int64]:
        """(k,) pixels that are black or white, counted row by row."""
        index = at_limits(self.grey.astype(np.uint8))
        return index[self.weight.ravel()[index] > 0.0]

    @property
    def clipped(self) -> bool:
        """Whether light beyond the limits of the sensor may be among them."""
        return len(self.at_limits) > 0


def quarter_turn(vectors: FloatArray) -> FloatArray:
    """Return (..., 2) vectors turned from x to y: a side's direction, into its square."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def image_sides(quads: FloatArray, cells: int, to_pixel: PlateToPixel) -> Sides:
    """Return the images of the sides of (n, 4, 2) quadrilaterals on the plate, metres.

    The cells within each are those of a square that lies in perspective on the plate, so that the
    map need not have the plate's true attitude.
    """
    H = pnp.homography(_CORNERS, quads, np.ones(quads.shape[:2], dtype=bool))
    edge = to_pixel(_parallel(H, 0.0, _KNOTS))
    chord = edge[:, -1] - edge[:, 0]
    length = np.linalg.norm(chord, axis=-1)
    frame = np.stack([chord, quarter_turn(chord)], axis=-1) / length[:, None, None]
    inner = to_pixel(_parallel(H, 1 / cells, _KNOTS))
    stops = to_pixel(_parallel(H, 1 / cells, np.arange(1, cells) / cells))
    line, inner, stops = ((each - edge[:, :1]) @ frame for each in (edge, inner, stops))
    curve = _polynomials(line[..., 0] / length[:, None], line[..., 1], _CURVE)
    share = inner[..., 0] / length[:, None]
    lean = (inner - line)[:, len(_KNOTS) // 2]
    origin = np.rint(edge[:, 0]).astype(np.int32)
    return Sides(
        origin=origin,
        first=edge[:, 0] - origin,
        along=frame[..., 0],
        length=length,
        curve=curve,
        depth=_polynomials(share, inner[..., 1] - _values(curve, share), _DEPTH),
        stops=stops[..., 0],
        skew=lean[:, 0] / lean[:, 1],
        others=_neighbours(frame[..., 1]) @ frame,
    )


def _parallel(H: FloatArray, depth: float, shares: FloatArray) -> FloatArray:
    """Return (m, k, 2) points of the plate along the sides, by a share of the square inside.

    Args:
        H: (n, 3, 3) maps from a square of side 1 to the plate.
        depth: How far inside, in sides.
        shares: (k,) how far along, in sides.
    """
    onward = np.roll(_CORNERS, -1, axis=0) - _CORNERS
    inward = np.roll(_CORNERS, 1, axis=0) - _CORNERS
    points = (_CORNERS + depth * inward)[:, None] + shares[:, None] * onward[:, None]
    mapped = points @ np.swapaxes(H, -1, -2)[:, None, :2] + H[:, None, None, :, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:]).reshape(-1, len(shares), 2)


def _neighbours(normals: FloatArray) -> FloatArray:
    """Return (m, 2, 2): of (m, 2) normals those of the side before and of the side after."""
    squares = normals.reshape(-1, SIDES, 2)
    both = np.stack([np.roll(squares, 1, axis=1), np.roll(squares, -1, axis=1)], axis=2)
    return both.reshape(-1, 2, 2)


def _polynomials(x: FloatArray, y: FloatArray, degree: int) -> FloatArray:
    """Return the (m, degree + 1) polynomials nearest to (m, k) points, constant first."""
    powers = x[..., None] ** np.arange(degree + 1)
    transposed = np.swapaxes(powers, -1, -2)
    return np.asarray(np.linalg.solve(transposed @ powers, transposed @ y[..., None])[..., 0])


def _values(coefficients: NDArray[Real], x: NDArray[Real]) -> NDArray[Real]:
    """Return the (m, k) values of (m, degree + 1) polynomials."""
    total = coefficients[:, -1:]
    for each in coefficients[:, -2::-1].T:
        total = total * x + each[:, None]
    return total


def band_pixels(
    image: NDArray[np.uint8],
    squares: Squares,
    sides: Sides,
    blur: FloatArray,
    band: float,
    *,
    step: int = 1,
) -> Band:
    """Select the pixels whose light only one side and the cells behind its border decide.

    Args:
        image: (height, width) grey image.
        squares: The squares.
        sides: Their sides.
        blur: (m,) standard deviation of the edges, pixels.
        band: Distance from the sides to which pixels are taken where there is room, pixels.
        step: Every `step`-th column is taken of a flat side, row of a steep one.
    """
    single = _Single.of(sides, blur)
    u, v, meant = _raster(sides, band, step)
    column, row = u + sides.origin[:, :1], v + sides.origin[:, 1:]
    meant &= (column >= 0) & (row >= 0) & (column < image.shape[1]) & (row < image.shape[0])
    x, y = single.local(u, v)
    place = x / single.length
    distance, depth = single.distance(place, y), _values(single.depth, place)
    chosen = meant & single.alone(x, y) & single.within(distance, depth, squares.margin, band)
    held = _held(chosen)
    spot = _packed(row * np.int32(image.shape[1]) + column, chosen, held)
    x, place, distance, depth = (
        _packed(each, chosen, held) for each in (x, place, distance, depth)
    )
    behind = distance - depth
    felt = np.max(behind + _FAR_BLURS * single.blur, where=held, initial=-np.inf) > 0
    return Band(
        grey=image.ravel()[spot].astype(np.float32),
        weight=held.astype(np.float32),
        place=place,
        distance=distance,
        behind=behind,
        cells=single.cells(squares.light, x, behind) if felt else None,
    )


def _raster(sides: Sides, band: float, step: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Return (m, k) pixels u, v around the sides, from their origins, and which are meant.

    A flat side is followed column by column, a steep one row by row.
    """
    steep = np.abs(sides.along[:, 1]) > np.abs(sides.along[:, 0])
    # major and minor direction instead of u and v
    along, across, first = (
        np.where(steep[:, None], each[:, ::-1], each)
        for each in (sides.along, quarter_turn(sides.along), sides.first)
    )
    last = first[:, 0] + sides.length * along[:, 0]
    begin = np.floor(np.minimum(first[:, 0], last)).astype(np.int32)
    end = np.ceil(np.maximum(first[:, 0], last)).astype(np.int32)
    major = begin[:, None] + np.arange(0, int(np.max(end - begin)) + 1, step, dtype=np.int32)
    x = (major - first[:, :1]) / along[:, :1]
    y = _values(sides.curve, np.clip(x / sides.length[:, None], 0.0, 1.0))
    middle = first[:, 1:] + x * along[:, 1:] + y / across[:, 1:]
    reach = math.ceil(band / float(np.min(np.abs(across[:, 1])))) + 1
    aside = np.arange(-reach, reach + 1, dtype=np.int32)
    minor = np.rint(middle).astype(np.int32)[..., None] + aside
    meant = np.broadcast_to((major <= end[:, None])[..., None], minor.shape)
    major = np.broadcast_to(major[..., None], minor.shape)
    flip = steep[:, None, None]
    u, v = np.where(flip, minor, major), np.where(flip, major, minor)
    return u.reshape(len(u), -1), v.reshape(len(v), -1), meant.reshape(len(u), -1).copy()


@dataclass(frozen=True)
class _Single:
    """The sides in single precision, each number with an axis for the pixels."""

    first: SingleArray
    along: SingleArray
    length: SingleArray
    curve: SingleArray
    depth: SingleArray
    stops: SingleArray
    skew: SingleArray
    others: SingleArray
    blur: SingleArray

    @classmethod
    def of(cls, sides: Sides, blur: FloatArray) -> _Single:
        """Return the sides with the blur of each."""
        arrays = (
            sides.first[..., None],
            sides.along[..., None],
            sides.length[:, None],
            sides.curve,
            sides.depth,
            sides.stops[..., None],
            sides.skew[:, None],
            sides.others[..., None],
            blur[:, None],
        )
        return cls(*(each.astype(np.float32) for each in arrays))

    def local(self, u: IntArray, v: IntArray) -> tuple[SingleArray, SingleArray]:
        """Return (m, k) coordinates x and y of pixels."""
        right, down = u - self.first[:, 0], v - self.first[:, 1]
        right, down = right.astype(np.float32), down.astype(np.float32)
        along_u, along_v = self.along[:, 0], self.along[:, 1]
        return right * along_u + down * along_v, down * along_u - right * along_v

    def distance(self, place: SingleArray, y: SingleArray) -> SingleArray:
        """Return the (m, k) distances from the sides, positive inside."""
        rising = (self.curve[:, 1:] * np.arange(1, _CURVE + 1)).astype(np.float32)
        slope = _values(rising, place) / self.length
        across = (y - _values(self.curve, place)) / np.sqrt(1.0 + slope * slope)
        return np.asarray(across, dtype=np.float32)

    def alone(self, x: SingleArray, y: SingleArray) -> BoolArray:
        """Return (m, k) whether pixels are far from the neighbouring sides."""
        before, after = self.others[:, 0], self.others[:, 1]
        far = np.maximum(_END_BLURS * self.blur, _LEAST_END)
        begin = x * before[:, 0] + y * before[:, 1] > far
        return np.asarray(begin & ((x - self.length) * after[:, 0] + y * after[:, 1] > far))

    def within(
        self, distance: SingleArray, depth: SingleArray, margin: float, band: float
    ) -> BoolArray:
        """Return (m, k) whether pixels are within the border or the light margin, and a band."""
        clear = np.maximum(margin * depth - _CLEAR_BLURS * self.blur, _LEAST_BLURS * self.blur)
        inside = distance < np.minimum(depth, band)
        return np.asarray(inside & (distance > -np.minimum(clear, band)))

    def cells(self, light: BoolArray, x: SingleArray, behind: SingleArray) -> SingleArray:
        """Return (2, m, k): how light the row of cells behind is, and how its ends lean in."""
        bits = np.pad(light.reshape(len(x), -1).astype(np.float32), ((0, 0), (1, 1)))
        stretch = np.sqrt(1.0 + self.skew * self.skew)
        scale = 1.0 / (self.blur * stretch)
        upright = x - self.skew * behind
        share, ends = np.zeros_like(x), np.zeros_like(x)
        for jump, stop in zip(np.diff(bits, axis=1).T, np.moveaxis(self.stops, 1, 0), strict=True):
            distribution, density = normal_distribution((upright - stop) * scale)
            share += jump[:, None] * distribution
            ends += jump[:, None] * density
        return np.stack([share, ends * (-self.skew / stretch)])


def _held(chosen: BoolArray) -> BoolArray:
    """Return the (m, p) places that hold a pixel when each row's chosen ones are moved up."""
    count = chosen.sum(axis=1)
    return np.asarray(np.arange(max(int(count.max()), 1)) < count[:, None])


def _packed(values: NDArray[Scalar], chosen: BoolArray, held: BoolArray) -> NDArray[Scalar]:
    """Return (m, p) the chosen of (m, k) values, padded with zeros."""
    packed = np.zeros(held.shape, dtype=values.dtype)
    packed[held] = values[chosen]
    return packed
