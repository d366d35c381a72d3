"""Stage: every method on the same stations, side by side, with its error on stations left out."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, Chain
from handeye_cli.errors import ConvergenceError, HandeyeError, InputError, UndeterminedError
from handeye_cli.estimation import choose_pairs
from handeye_cli.examination import Examined
from handeye_cli.geometry import se3
from handeye_cli.held_out import held_out_errors
from handeye_cli.leave_one_out import leave_out
from handeye_cli.motion_check import check_motions
from handeye_cli.part_calibration import usable_chain
from handeye_cli.records import Calibration, Comparison, FloatArray, IntArray, Stations
from handeye_cli.solve import answer
from handeye_cli.solvers import Problem, Solution
from handeye_cli.solvers.station_mean import mean_target

_FAILURES = (InputError, UndeterminedError, ConvergenceError)
_LARGEST_BLOCK = 50_000
"""Motions that are solved for at once."""


def compare(
    stations: Stations, *, method: str = solvers.DEFAULT, pairs: str = "star"
) -> Calibration:
    """Compute where the camera sits by one method, and list what all others say beside it.

    Args:
        stations: Robot and target poses; stations without a target pose are left out.
        method: The method of the answer.
        pairs: `star` or `all`, for the methods that use pairs.

    Raises:
        HandeyeError: The method of the answer fails; another one that does says so in its row.
    """
    chosen = answer(stations, method=method, pairs=pairs)
    examined = chosen.examined
    left_out = _LeftOut(stations, _good(usable_chain(stations), examined), pairs)
    ordered = sorted(solvers.names(), key=lambda name: name != solvers.DEFAULT)
    answers = {
        name: chosen.calibration if name == method else _attempt(examined, name, pairs)
        for name in ordered
    }
    reference = answers[solvers.DEFAULT]
    rows = (_row(name, found, reference, left_out) for name, found in answers.items())
    return replace(chosen.calibration, comparison=tuple(rows))


def _good(chain: Chain, examined: Examined) -> Chain:
    """Return a chain without the stations that no answer rests on."""
    return chain.part(np.flatnonzero(~np.isin(chain.index, list(examined.reasons))))


def _attempt(examined: Examined, method: str, pairs: str) -> Calibration | HandeyeError:
    try:
        return answer(examined.stations, method=method, pairs=pairs, examined=examined).calibration
    except _FAILURES as error:
        return error


def _row(
    method: str,
    found: Calibration | HandeyeError,
    reference: Calibration | HandeyeError,
    left_out: _LeftOut,
) -> Comparison:
    if isinstance(found, HandeyeError):
        return Comparison(method, reason=found.message)
    error = found.predicted_error
    row = Comparison(
        method, predicted_rotation=error.rotation, predicted_translation=error.translation
    )
    if isinstance(reference, Calibration):
        apart = se3.difference(found.mount_T_camera.matrix, reference.mount_T_camera.matrix)
        rotation, translation = _lengths(apart[None])
        row = replace(row, rotation=rotation, translation=translation)
    try:
        rotation, translation = _lengths(left_out.errors(method))
    except _FAILURES as failure:
        where = f"{failure.where}: " if failure.where else ""
        return replace(row, reason=f"no held-out error: {where}{failure.message}")
    return replace(row, held_out_rotation=rotation, held_out_translation=translation)


def _lengths(vectors: FloatArray) -> tuple[float, float]:
    """Return the RMS rotation and translation of (M, 6) perturbations."""
    translation, rotation = np.sqrt(se3.by_kind(np.mean(vectors**2, axis=0)))
    return float(rotation), float(translation)


@dataclass(frozen=True)
class _LeftOut:
    """Calibrations on all stations but one, for each of them."""

    stations: Stations
    chain: Chain
    pairs: str

    def errors(self, method: str) -> FloatArray:
        """Return the (N, 6) errors of the camera's poses at the stations left out.

        Raises:
            UndeterminedError: Without one of the stations nothing is determined.
            ConvergenceError: Without one of them the estimation did not settle.
        """
        count = len(self.chain.A)
        if count <= MIN_STATIONS:
            raise UndeterminedError(
                f"expected at least {MIN_STATIONS + 1} usable stations, found {count}"
            )
        if method == solvers.MAXIMUM_LIKELIHOOD:
            # One by one, with the noise that each set of stations shows.
            found = leave_out(self.stations, self.chain, method=method, pairs=self.pairs)
            return found.errors.vectors
        return held_out_errors(self.chain, self._together(method)).vectors

    def _together(self, method: str) -> Solution:
        """Solve all sets at once by a closed form, which does not ask for the noise."""
        if self._undetermined is not None:
            raise self._undetermined
        chosen, solver = choose_pairs(self.pairs, len(self.chain.A) - 1), solvers.load(method)
        found = []
        blocks = math.ceil(len(self.chain.A) * len(chosen) / _LARGEST_BLOCK)
        for block in np.array_split(self._sets(), blocks):
            A, B = self.chain.A[block], self.chain.B[block]
            equal = np.broadcast_to(np.eye(12), (block.shape[1], 12, 12))
            X = solver.solve(Problem(A, B, chosen, equal)).X
            found.append((X, mean_target(A, B, X)))
        X, Z = (np.concatenate(each) for each in zip(*found, strict=True))
        return Solution(X, Z)

    def _sets(self) -> IntArray:
        """Return (N, N - 1) rows: the stations without the first, without the second, ..."""
        count = len(self.chain.A)
        everyone = np.broadcast_to(np.arange(count), (count, count))
        return everyone[~np.eye(count, dtype=bool)].reshape(count, count - 1)

    @functools.cached_property
    def _undetermined(self) -> UndeterminedError | None:
        """What is wrong with the first set that determines nothing."""
        chosen = choose_pairs(self.pairs, len(self.chain.A) - 1)
        for row, others in enumerate(self._sets()):
            try:
                check_motions(self.chain.part(others), chosen, self.stations.setup)
            except UndeterminedError as error:
                return UndeterminedError(error.message, where=self._where(row), hint=error.hint)
        return None

    def _where(self, row: int) -> str:
        name = self.stations.stations[self.chain.index[row]].name
        return f'leaving out station "{name}"'
