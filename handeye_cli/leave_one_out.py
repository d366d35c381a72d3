"""Stage: every station predicted by a calibration on all others, for recordings too small for 2N.

The N errors share their data: each station helps to predict all others. The verdict takes that
into account in two ways.

- A station's own error is normal with the covariance that the influence of the other stations and
  its own noise give it, or Student's where the noise was estimated, from those others. The largest
  of the 2 N squares (rotation and translation) is judged by the chance that the largest of so many
  is as large.
- Where the noise was given, all errors together are chi-square as well. To first order they are an
  invertible map of what is left of the N loops once 12 unknowns are fitted, so their squares,
  weighted with their full covariance of rank 6 N - 12, are those of the best fit to all stations.
  Where the noise was estimated, that sum has been used for the estimate and says nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, Chain
from handeye_cli.errors import UndeterminedError
from handeye_cli.estimation import choose_pairs, estimate
from handeye_cli.examination import require_conventions
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.held_out import (
    SIGNIFICANCE,
    HeldOutErrors,
    HeldOutPrediction,
    chance_of,
    error_covariances,
    held_out_errors,
    rms_of,
    weighted_squares,
)
from handeye_cli.held_out_pixels import PixelErrors, pixel_errors
from handeye_cli.part_calibration import (
    PartCalibration,
    calibrate_part,
    noise_of_others,
    usable_chain,
)
from handeye_cli.records import Finding, FloatArray, Protocol, Stations, Verification
from handeye_cli.seen_through import chain_through
from handeye_cli.solvers.problem import Solution
from handeye_cli.verification_row import row_of
from handeye_cli.wording import error_sizes

_PARTS = (slice(3, 6), slice(0, 3))
"""Rotation and translation of an error."""


@dataclass(frozen=True)
class LeftOut:
    """Errors of all N stations, each with the covariance that its calibration predicts.

    Attributes:
        errors: Of the N stations.
        seen: The same in the image and on the plate.
        covariances: (N, 6, 6) of the errors.
        freedom: (2, N) degrees of freedom of the noise in their rotations and translations.
    """

    errors: HeldOutErrors
    seen: PixelErrors
    covariances: FloatArray
    freedom: FloatArray


def leave_one_out(
    stations: Stations, *, method: str = solvers.DEFAULT, pairs: str = "star"
) -> Verification:
    """Predict the camera's pose at every usable station by a calibration on all others.

    It takes N calibrations, each in O(N).

    Args:
        stations: Robot and target poses.
        method: A row of the table of solvers.
        pairs: `star` or `all`.

    Raises:
        UsageError: Unknown method or pairs.
        UndeterminedError: Too few stations, or a station without which nothing is determined.
        ConvergenceError: An estimation did not settle.
    """
    chain = usable_chain(stations)
    count = len(chain.A)
    if count <= MIN_STATIONS:
        raise UndeterminedError(
            f"expected at least {MIN_STATIONS + 1} usable stations, to calibrate on all but one, "
            f"found {count}",
            hint="record more stations",
        )
    require_conventions(stations, chain)
    found = leave_out(stations, chain, method=method, pairs=pairs)
    chances = _chances(found)
    rotation, translation = rms_of(found.covariances)
    prediction = HeldOutPrediction(rotation, translation, _chance(stations, chain, chances))
    row = row_of(stations, chain, found.errors, found.seen, count=count - 1, prediction=prediction)
    return Verification(
        setup=stations.setup,
        method=method,
        rows=(row,),
        diagnosis=(*stations.findings, *_apart(stations, chain, found, chances)),
        provenance=stations.provenance,
        protocol=Protocol.LEAVE_ONE_OUT,
    )


def leave_out(stations: Stations, chain: Chain, *, method: str, pairs: str) -> LeftOut:
    """Predict each of N stations by a calibration on the others.

    Args:
        stations: The document.
        chain: Its usable stations, at least four.
        method: A row of the table of solvers.
        pairs: `star` or `all`.

    Raises:
        UsageError: Unknown method or pairs.
        UndeterminedError: A station without which nothing is determined.
        ConvergenceError: An estimation did not settle.
    """
    parts = [_calibrate_without(stations, chain, i, method, pairs) for i in range(len(chain.A))]
    ones = [
        chain_through(stations, chain.part(slice(i, i + 1)), part.camera)
        for i, part in enumerate(parts)
    ]
    X, Z = (np.array([getattr(part.solution, name) for part in parts]) for name in "XZ")
    seen_chain = replace(chain, B=np.concatenate([one.B for one in ones]))
    errors = held_out_errors(seen_chain, Solution(X, Z))
    seen = [
        pixel_errors(stations, one.index, pose[None], part.camera)
        for one, pose, part in zip(ones, errors.camera_T_target, parts, strict=True)
    ]
    own = [
        noise_of_others(one, stations.noise, part.model.noise, part.solution)
        for one, part in zip(ones, parts, strict=True)
    ]
    covariances = np.array([part.covariance for part in parts])
    return LeftOut(
        errors=errors,
        seen=PixelErrors(
            np.concatenate([each.reprojection for each in seen]),
            np.concatenate([each.plate for each in seen]),
        ),
        covariances=error_covariances(errors, covariances, np.concatenate(own)),
        freedom=np.array([[part.freedom(rows) for part in parts] for rows in _PARTS]),
    )


def _calibrate_without(
    stations: Stations, chain: Chain, left_out: int, method: str, pairs: str
) -> PartCalibration:
    others = chain.part(np.delete(np.arange(len(chain.A)), left_out))
    where = f'leaving out station "{stations.stations[chain.index[left_out]].name}"'
    return calibrate_part(others, stations, method=method, pairs=pairs, where=where)


def _chances(found: LeftOut) -> FloatArray:
    """Return (2, N): the chance of each station's rotation and translation error by itself."""
    rows = []
    for part, freedom in zip(_PARTS, found.freedom, strict=True):
        errors, covariances = found.errors.vectors[:, part], found.covariances[:, part, part]
        weighted = np.linalg.solve(covariances, errors[..., None])[..., 0]
        rows.append(chance_of(np.sum(errors * weighted, axis=-1), 3, freedom))
    return np.array(rows)


def _chance(stations: Stations, chain: Chain, chances: FloatArray) -> float:
    """Return the chance of errors that are as unlikely as these, or more so, if all is well."""
    largest = _of_many(float(chances.min()), chances.size)
    squares = _squares_of_all(stations, chain)
    if squares is None:
        return largest
    together = float(chance_of(squares, 6 * len(chain.A) - 12))
    return _of_many(min(largest, together), 2)


def _of_many(chance: float, count: int) -> float:
    """Return the chance that the least likely of `count` things is as unlikely as this one."""
    return -math.expm1(count * math.log1p(-chance)) if chance < 1.0 else 1.0


def _squares_of_all(stations: Stations, chain: Chain) -> float | None:
    """Return the weighted squares of all errors together, or None where the noise is estimated."""
    everywhere = choose_pairs("star", len(chain.A))
    _, best, model = estimate(chain, everywhere, stations, solvers.MAXIMUM_LIKELIHOOD)
    if len(model.shapes):
        return None
    loop = loop_jacobians(chain.A, chain.B, best.X, best.Z)
    own = loop.by_poses @ model.covariance @ np.swapaxes(loop.by_poses, -1, -2)
    return weighted_squares(loop.residuals, own, chain.by_shared_causes(loop), loop.by_unknowns)


def _apart(
    stations: Stations, chain: Chain, found: LeftOut, chances: FloatArray
) -> tuple[Finding, ...]:
    """Return the finding that one station contradicts the others, if one does."""
    if _of_many(float(chances.min()), chances.size) > SIGNIFICANCE:
        return ()
    worst = int(np.argmin(chances.min(axis=0)))
    name = stations.stations[chain.index[worst]].name
    rotation, translation = rms_of(found.covariances[worst : worst + 1])
    message = (
        f'the other stations predict station "{name}" worse than they should: '
        f"{error_sizes(found.errors.rotation[worst], found.errors.translation[worst])} off, where "
        f"{error_sizes(rotation, translation)} are expected"
    )
    return (Finding("station-apart", "warning", message, "look at its image and its robot pose"),)
