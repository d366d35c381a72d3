"""What is common to the residuals of all views: the target's shape, the lens, smooth distortions.

Every view has its own pose, which takes up most of any error. What it does not take up of the
derivatives by common unknowns decides how well these are known, and which of them explain the
residuals. All of that is in one small matrix of products, so that one walk over the pixels serves
every combination of unknowns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp
from handeye_cli.geometry.camera import Lens
from handeye_cli.geometry.pnp import Sightings

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_CHUNK = 256
"""Views whose derivatives are held at a time."""
_HIDDEN = 1e-8
"""Part of a direction's squares that the poses must leave, for it to be seen at all."""
_CERTAIN = 3.5
"""Standard deviations from which on a direction of unknowns is certain not to be noise."""
_FLAT = 1e-6
"""Height of a field over the points, relative to its largest, that is taken as none."""
BOW = 3
"""Terms of the bow: along x, twist, along y."""
STRAIN = 2
"""Terms in the plate's plane: aspect, shear."""
_IMAGE_DEGREE = 3


def plate_fields(points: FloatArray) -> FloatArray:
    """Return how the points of a plate move with its shape.

    A bow is quadratic, of height one metre at the edge, without the plane that a pose takes up; a
    strain of one takes columns apart by half of it and rows together by the other half, or shears.
    A common scale is none of them: it is a nearer plate.

    Args:
        points: (n, 3) points with z = 0, metres.

    Returns:
        (n, 3, 5) displacements in metres: three of the bow, two of the strain. Those that the
        points do not show, such as the bow of a tag's four corners, are zero.
    """
    low, high = points.min(axis=0)[:2], points.max(axis=0)[:2]
    middle, half = (low + high) / 2, float(np.max(high - low)) / 2
    x, y = ((points[:, :2] - middle) / half).T
    plane = np.stack([np.ones_like(x), x, y], axis=1)
    bow = np.stack([x * x, x * y, y * y], axis=1)
    bow = bow - plane @ np.linalg.lstsq(plane, bow, rcond=None)[0]
    fields = np.zeros((len(points), 3, BOW + STRAIN))
    fields[:, 2, :BOW] = np.where(np.ptp(bow, axis=0) > _FLAT, bow, 0.0)
    fields[:, 0, BOW], fields[:, 1, BOW] = 0.5 * half * x, -0.5 * half * y
    fields[:, 0, BOW + 1], fields[:, 1, BOW + 1] = 0.5 * half * y, 0.5 * half * x
    return fields


@dataclass(frozen=True)
class PosedViews:
    """Views of a target with their poses.

    Attributes:
        poses: (N, 4, 4) camera_T_target that fits each view best.
        seen: The N views.
        sigma: (N,) pixel noise.
        lens: Intrinsics.
    """

    poses: FloatArray
    seen: Sightings
    sigma: FloatArray
    lens: Lens

    def part(self, rows: slice) -> PosedViews:
        """Return some of the views."""
        return PosedViews(self.poses[rows], self.seen.part(rows), self.sigma[rows], self.lens)


@dataclass(frozen=True)
class CommonCauses:
    """What may move the pixels of all views at once.

    Attributes:
        directions: (4 + k, m) how the intrinsics move with unknowns of their own.
        prior: (m, m) information on these beforehand.
        fields: (n, 3, p) how the plate's points move with its shape, metres in the target's frame.
        image_size: (width, height) over which a cubic distorts the image, pixels; None for none.
        at: (m,) what the intrinsics' unknowns are where the views stand, as the prior counts them.
    """

    directions: FloatArray
    prior: FloatArray
    fields: FloatArray
    image_size: tuple[int, int] | None
    at: FloatArray

    @property
    def lens(self) -> IntArray:
        """Columns of the intrinsics."""
        return np.arange(self.directions.shape[1])

    @property
    def plate(self) -> IntArray:
        """Columns of the plate's shape."""
        return np.asarray(np.arange(self.fields.shape[2]) + self.directions.shape[1])

    @property
    def image(self) -> IntArray:
        """Columns of the distortion of the image."""
        count = 0 if self.image_size is None else 2 * len(_powers())
        first = self.directions.shape[1] + self.fields.shape[2]
        return np.asarray(np.arange(count) + first)


@dataclass(frozen=True)
class CommonEquations:
    """The views' equations in the common unknowns, all poses eliminated, for unit pixel noise.

    Attributes:
        products: (c + 1, c + 1) of the columns with each other; the residuals are the last.
        before: (c,) squares of the columns before the poses took their part.
        by_common: (N, 6, c) how the pose that fits a view best moves with the unknowns.
        freedom: Residuals minus the poses' unknowns.
    """

    products: FloatArray
    before: FloatArray
    by_common: FloatArray
    freedom: int

    def fitted(self, columns: IntArray) -> Fitted:
        """Return the least-squares fit of some columns, those that cannot be seen at zero."""
        A, b = self.products[np.ix_(columns, columns)], self.products[columns, -1]
        return _least_squares(A, b, float(self.products[-1, -1]), self.before[columns])

    def moves(self, columns: IntArray) -> FloatArray:
        """Return the (N, 6) moves of the poses when some columns are fitted."""
        return np.asarray(self.by_common[..., columns] @ self.fitted(columns).values)

    def moves_beyond(self, known: IntArray, columns: IntArray) -> FloatArray:
        """Return the (N, 6) further moves when some columns are fitted beside known ones.

        Of the columns only what is certain counts: weakly seen distortions move poses far.
        """
        fit, base = self.beyond(known, columns), self.fitted(known)
        left = max(self.freedom - base.rank - fit.rank, 1)
        values = fit.certain(float(np.sqrt(fit.squares / left)))
        answer = -base.root @ (base.root.T @ self.products[np.ix_(known, columns)] @ values)
        return np.asarray(
            self.by_common[..., columns] @ values + self.by_common[..., known] @ answer
        )

    def beyond(self, known: IntArray, columns: IntArray) -> Fitted:
        """Return the fit of some columns to what others, which are fitted as well, leave."""
        both = np.append(columns, len(self.before))
        root = self.fitted(known).root
        along = root.T @ self.products[np.ix_(known, both)]
        left = self.products[np.ix_(both, both)] - along.T @ along
        return _least_squares(
            left[:-1, :-1], left[:-1, -1], float(left[-1, -1]), self.before[columns]
        )


def _least_squares(A: FloatArray, b: FloatArray, squares: float, before: FloatArray) -> Fitted:
    scale = 1.0 / np.sqrt(np.maximum(before, np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(scale[:, None] * A * scale)
    seen = values > _HIDDEN
    root = scale[:, None] * vectors[:, seen] / np.sqrt(values[seen])
    along = root.T @ b
    left = max(squares - float(along @ along), 0.0)
    return Fitted(along, root, max(squares, 0.0), left)


@dataclass(frozen=True)
class Fitted:
    """A least-squares fit of k unknowns.

    Attributes:
        along: (r,) minus the unknowns' r directions that are seen, each with unit noise.
        root: (k, r) these directions, a root of the unknowns' covariance for unit noise.
        squares_before: Squares of the residuals with all unknowns at zero.
        squares: What is left of them.
    """

    along: FloatArray
    root: FloatArray
    squares_before: float
    squares: float

    @property
    def values(self) -> FloatArray:
        """(k,) the unknowns."""
        return np.asarray(-self.root @ self.along)

    def certain(self, noise: float) -> FloatArray:
        """Return (k,) the unknowns without the directions that this RMS noise may feign."""
        kept = np.abs(self.along) > _CERTAIN * noise
        return np.asarray(-self.root[:, kept] @ self.along[kept])

    @property
    def rank(self) -> int:
        """How many directions of the unknowns are seen."""
        return int(self.root.shape[1])

    @property
    def covariance(self) -> FloatArray:
        """(k, k) of the unknowns, for unit noise."""
        return np.asarray(self.root @ self.root.T)


def common_equations(views: PosedViews, causes: CommonCauses) -> CommonEquations:
    """Return what the residuals say of causes that all views share.

    Args:
        views: The views, each with the pose that fits it best.
        causes: The unknowns that are shared.
    """
    size = causes.directions.shape[1] + causes.fields.shape[2] + len(causes.image)
    products, before, by_common = np.zeros((size + 1, size + 1)), np.zeros(size), []
    for part in _parts(views, causes):
        flat = part.columns.reshape(-1, size + 1)
        products += flat.T @ flat
        before += part.before
        by_common.append(part.by_common)
    known = causes.lens
    squares = np.block([[np.eye(len(known)), causes.at[:, None]]])
    rows = np.append(known, size)
    products[np.ix_(rows, rows)] += squares.T @ causes.prior @ squares
    before[known] += np.diag(causes.prior)
    moves = np.concatenate([np.zeros((0, 6, size)), *by_common])
    freedom = 2 * int(views.seen.mask.sum()) - 6 * len(views.poses)
    return CommonEquations(products, before, moves, freedom)


@dataclass(frozen=True)
class _Part:
    """Some views: (v, n, 2, c + 1) columns, (c,) their squares before, (v, 6, c) pose moves."""

    columns: FloatArray
    before: FloatArray
    by_common: FloatArray


def _parts(views: PosedViews, causes: CommonCauses) -> Iterator[_Part]:
    for first in range(0, len(views.poses), _CHUNK):
        yield _part(views.part(slice(first, first + _CHUNK)), causes)


def _part(views: PosedViews, causes: CommonCauses) -> _Part:
    poses, seen = views.poses, views.seen
    r, J, K = pnp.residuals(poses, seen, views.lens)
    by_point = J[..., :3] @ poses[:, None, :3, :3]
    columns = np.concatenate(
        [
            K @ causes.directions,
            by_point @ causes.fields,
            _bent(seen.pixels + r, seen.mask, causes),
            r[..., None],
        ],
        axis=-1,
    )
    rows = len(poses), 2 * seen.points.shape[0]
    J, flat = (
        each.reshape(*rows, each.shape[-1]) / views.sigma[:, None, None] for each in (J, columns)
    )
    Jt = np.swapaxes(J, -1, -2)
    moves = -np.asarray(np.linalg.solve(Jt @ J, Jt @ flat))
    left = (flat + J @ moves).reshape(columns.shape)
    before = np.einsum("vnk,vnk->k", flat, flat)
    return _Part(left, before[:-1], moves[..., :-1])


def _powers() -> list[tuple[int, int]]:
    degrees = range(_IMAGE_DEGREE + 1)
    return [(i, j) for i in degrees for j in degrees if i + j <= _IMAGE_DEGREE]


def _bent(pixels: FloatArray, mask: BoolArray, causes: CommonCauses) -> FloatArray:
    """Return (v, n, 2, q) monomials of where the model has the points, in pixels at the edge.

    Where they were measured would not do: the noise of a measurement explains itself.
    """
    if causes.image_size is None:
        return np.zeros((*pixels.shape, 0))
    half = (np.array(causes.image_size) - 1) / 2
    u, v = np.moveaxis((np.where(mask[..., None], pixels, half) - half) / half[0], -1, 0)
    terms = np.stack([u**i * v**j for i, j in _powers()], axis=-1) * mask[..., None]
    nothing = np.zeros_like(terms)
    across = np.concatenate([terms, nothing], axis=-1)
    return np.stack([across, np.concatenate([nothing, terms], axis=-1)], axis=-2)


def clustered_covariances(
    views: PosedViews, causes: CommonCauses, fit: Fitted, columns: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return a fit's covariance by how much points, and views, contradict each other.

    Errors of the print are the same in all views, those of a view the same for all its points:
    neither is less with more pixels, which a covariance of independent pixels would have.

    Args:
        views: The views, each with the pose that fits it best.
        causes: The unknowns.
        fit: Of some of them.
        columns: (k,) which those are.

    Returns:
        (k, k) by the points and (k, k) by the views.
    """
    by_point, by_view = np.zeros((len(views.seen.points), len(columns))), []
    for part in _parts(views, causes):
        picked = part.columns[..., columns]
        left = part.columns[..., -1] + picked @ fit.values
        scores = np.einsum("vndk,vnd->vnk", picked, left)
        by_point += scores.sum(axis=0)
        by_view.append(scores.sum(axis=1))
    return _sandwich(by_point, fit), _sandwich(np.concatenate(by_view), fit)


def _sandwich(scores: FloatArray, fit: Fitted) -> FloatArray:
    moves = scores @ fit.covariance
    return np.asarray(moves.T @ moves * (len(scores) / max(len(scores) - 1, 1)))
