"""One look at what the residuals of a recording have in common, with tests of each cause."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.geometry import plate_surface, pnp
from handeye_cli.geometry.plate_surface import (
    BOW,
    CommonCauses,
    CommonEquations,
    Fitted,
    PosedViews,
)
from handeye_cli.geometry.tail_probabilities import f_tail
from handeye_cli.pixel_data import PixelData
from handeye_cli.records import FloatArray, IntArray

SIGNIFICANCE = 1e-3
"""Chance that a good recording is blamed by one of the tests."""
_EXACT = 1e-2
"""RMS of residuals, in their noise, that are mere rounding."""
_WORTH_TELLING = 0.02
"""Part of the residual's squares below which a surface, however certain, changes nothing."""


@dataclass(frozen=True)
class Test:
    """Chance that a surface gains what it gains, and the part of the squares it explains."""

    chance: float
    share: float

    @property
    def passed(self) -> bool:
        """Whether the surface is there, and matters."""
        return self.chance < SIGNIFICANCE and self.share > _WORTH_TELLING


@dataclass(frozen=True)
class Sized:
    """A fit of some columns, with covariances by pixels, by points, and by views."""

    columns: IntArray
    fit: Fitted
    by_pixels: FloatArray
    clusters: tuple[tuple[int, FloatArray], ...]

    def part(self, columns: IntArray) -> tuple[FloatArray, list[FloatArray]]:
        """Return the values of some of the columns, and all their covariances."""
        rows = np.searchsorted(self.columns, columns)
        pick = np.ix_(rows, rows)
        spreads = [self.by_pixels, *(spread for _, spread in self.clusters)]
        return self.fit.values[rows], [spread[pick] for spread in spreads]

    def chance(self, columns: IntArray) -> float:
        """Return the chance of values this large that points, or views, give by chance."""
        values, (_, *spreads) = self.part(columns)
        chances = [
            _chance_of_mean(values, spread, count)
            for (count, _), spread in zip(self.clusters, spreads, strict=True)
        ]
        return max(chances)

    def sigma(self, columns: IntArray, slope: FloatArray) -> float:
        """Return the largest standard deviation of a linear function of the values."""
        return math.sqrt(max(float(slope @ spread @ slope) for spread in self.part(columns)[1]))


@dataclass(frozen=True)
class Look:
    """The equations of a recording's residuals at one state of poses, lens and plate.

    Attributes:
        views: The views at that state.
        causes: What may move them all.
        equations: What their residuals say of it.
    """

    views: PosedViews
    causes: CommonCauses
    equations: CommonEquations

    @classmethod
    def at(cls, data: PixelData) -> Look:
        """Look at a document's pixels where it has its poses and its intrinsics."""
        size = data.directions.shape[1]
        causes = CommonCauses(
            directions=data.directions,
            prior=np.zeros((size, size)) if data.calibrated else np.eye(size),
            fields=plate_surface.plate_fields(data.views.seen.points),
            image_size=(data.camera.width, data.camera.height),
            at=np.zeros(size),
        )
        views = PosedViews(data.poses, data.views.seen, data.sigma, data.camera.lens)
        return cls(views, causes, plate_surface.common_equations(views, causes))

    def with_plate(self) -> Look:
        """Look again with the plate's shape and the lens where they fit the residuals best."""
        views, causes = self.views, self.causes
        values = self.equations.fitted(np.concatenate([causes.lens, causes.plate])).values
        of_lens, of_plate = np.split(values, [len(causes.lens)])
        moved = views.lens.parameters + causes.directions @ of_lens
        lens = replace(views.lens, parameters=moved)
        seen = replace(views.seen, points=views.seen.points + causes.fields @ of_plate)
        poses, _ = pnp.refine(views.poses, seen, lens)
        views = PosedViews(poses, seen, views.sigma, lens)
        causes = replace(causes, at=causes.at + of_lens)
        return Look(views, causes, plate_surface.common_equations(views, causes))

    @property
    def bow(self) -> IntArray:
        """Columns of the bow."""
        return self.causes.plate[:BOW]

    @property
    def strain(self) -> IntArray:
        """Columns of the strain."""
        return self.causes.plate[BOW:]

    def test(self, columns: IntArray, *known: IntArray) -> Test:
        """Return what some columns explain of the residuals beyond the lens and known ones."""
        base = np.concatenate([self.causes.lens, *known])
        fit = self.equations.beyond(base, columns)
        left = self.equations.freedom - self.equations.fitted(base).rank - fit.rank
        if fit.rank == 0 or left < 1 or fit.squares_before < _EXACT**2 * left:
            return Test(1.0, 0.0)
        gain = fit.squares_before - fit.squares
        ratio = gain / fit.rank / max(fit.squares / left, np.finfo(float).tiny)
        return Test(f_tail(ratio, fit.rank, left), gain / fit.squares_before)

    def sized(self, *causes: IntArray) -> Sized:
        """Return the fit of the lens and some more columns, in ascending order."""
        columns = np.concatenate([self.causes.lens, *causes])
        fit = self.equations.fitted(columns)
        variance = fit.squares / (self.equations.freedom - fit.rank)
        by_points, by_views = plate_surface.clustered_covariances(
            self.views, self.causes, fit, columns
        )
        shown = int(self.views.seen.mask.any(axis=0).sum())
        clusters = (shown, by_points), (len(self.views.poses), by_views)
        return Sized(columns, fit, variance * fit.covariance, clusters)

    def pixels(self, *causes: IntArray) -> float:
        """Return the RMS residual with the lens and some more columns fitted, pixels."""
        fit = self.equations.fitted(np.concatenate([self.causes.lens, *causes]))
        sigma = np.sqrt(np.mean(self.views.sigma**2))
        return float(sigma * np.sqrt(fit.squares / (self.equations.freedom - fit.rank)))


def _chance_of_mean(values: FloatArray, covariance: FloatArray, count: int) -> float:
    """Return the chance of Hotelling's T^2 of values whose covariance `count` clusters give."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    spread = scale[:, None] * covariance * scale
    rank = int(np.linalg.matrix_rank(spread, hermitian=True))
    if rank == 0 or count <= rank:
        return 1.0
    z = scale * values
    square = float(z @ np.linalg.pinv(spread, hermitian=True) @ z)
    return f_tail(square * (count - rank) / (rank * (count - 1)), rank, count - rank)
