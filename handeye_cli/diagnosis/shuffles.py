"""Which robot pose belongs to which target pose, when the order of the lists says nothing.

The angles between three target poses are looked for among the robot's; each triple that matches is
a rotation from camera to mount, and the one that explains the most other stations wins.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.diagnosis.hypotheses import Hypothesis
from handeye_cli.diagnosis.pairings import paired
from handeye_cli.diagnosis.readings import Reading
from handeye_cli.geometry import rotations, statistics
from handeye_cli.geometry.motion_invariants import fit_rotations, pair_angles
from handeye_cli.records import FloatArray, IntArray

SHUFFLED = "lists-shuffled"
_MOST_STATIONS = 40
"""Of more stations there are too many triples."""
_MATCH = 0.04
"""Difference of angles in radians that noise explains."""
_SEEDS = 4
_MOST_TRIPLES = 200
"""Triples of robot poses that are tried for each triple of target poses, the best matches first."""
_LARGEST_TURN = 2.8
"""Turns beyond this angle in radians have an axis that noise may turn round."""
_LEAST_SHARE = 0.7
"""Share of the stations that a pairing has to explain."""
_FEWEST = 5
_NAMED = 4
"""Stations that are named; more would only be a long list."""


def found_pairing(reading: Reading) -> Hypothesis | None:
    """Return the pairing that most stations agree on, or None where there is none.

    Args:
        reading: The numbers as declared; of more than 40 stations no pairing is looked for.
    """
    if len(reading.robot) > _MOST_STATIONS:
        return None
    A = reading.reference_T_mount(reading.robot, inverted=reading.inverted)[:, :3, :3]
    rows = _best_rows(A, reading.camera[:, :3, :3])
    needed = max(_FEWEST, round(_LEAST_SHARE * len(rows)))
    if np.sum(rows >= 0) < needed or np.array_equal(rows, reading.index):
        return None
    moved = np.flatnonzero((rows >= 0) & (rows != reading.index))
    named = [f"{reading.names[reading.index[k]]} to {reading.names[rows[k]]}" for k in moved]
    more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
    description = f"target poses belong to other robot poses: {', '.join(named[:_NAMED])}{more}"
    advice = "record the name or the time of the picture with each robot pose"
    return paired(reading, rows, SHUFFLED, description, advice)


def angle_difference(reading: Reading) -> float:
    """Return the median difference of the angles between robot poses and target poses, radians."""
    robot = pair_angles(reading.robot[reading.index, :3, :3])
    camera = pair_angles(reading.camera[:, :3, :3])
    pairs = np.triu_indices(len(robot), 1)
    return statistics.median(np.abs(robot - camera)[pairs])


def _best_rows(A: FloatArray, B: FloatArray) -> IntArray:
    """Return the (N,) robot pose of each target pose, -1 where none fits."""
    best, rows = -1.0, np.full(len(B), -1)
    of_robot = pair_angles(A)
    for triple in _seeds(B):
        matches = _matching(of_robot, pair_angles(B[triple]))
        if len(matches) == 0:
            continue
        seen = np.broadcast_to(B[triple], (len(matches), 3, 3, 3))
        everyone = np.ones((len(matches), 3), dtype=bool)
        found = fit_rotations(A[matches], seen, everyone, np.full(len(matches), 3))
        misses = _misses(A, B, found.R_X, found.R_Z)
        explained = np.sum(np.clip(1.0 - np.min(misses, axis=1) / _MATCH, 0.0, None), axis=1)
        winner = int(np.argmax(explained))
        if explained[winner] > best:
            best, rows = float(explained[winner]), _mutual(misses[winner])
    return rows


def _seeds(B: FloatArray) -> list[IntArray]:
    """Return triples of target poses between which the camera turns about different axes."""
    triples = []
    for first in np.unique(np.linspace(0, len(B) - 1, _SEEDS).astype(int)):
        turns = rotations.log(np.swapaxes(B[first], -1, -2) @ B)
        sizes = np.linalg.norm(turns, axis=1)
        turns = np.where(sizes[:, None] < _LARGEST_TURN, turns, 0.0)
        areas = np.linalg.norm(np.cross(turns[:, None], turns[None]), axis=-1)
        second, third = np.unravel_index(np.argmax(areas), areas.shape)
        triples.append(np.array([first, second, third]))
    return triples


def _matching(of_robot: FloatArray, wanted: FloatArray) -> IntArray:
    """Return the (T, 3) triples of robot poses with the same three angles between them."""
    first = np.abs(of_robot - wanted[0, 1])[:, :, None]
    second = np.abs(of_robot - wanted[0, 2])[:, None, :]
    third = np.abs(of_robot - wanted[1, 2])[None, :, :]
    worst = np.maximum(np.maximum(first, second), third)
    triples = np.argwhere(worst < _MATCH)
    order = np.argsort(worst[tuple(triples.T)], kind="stable")
    return triples[order[:_MOST_TRIPLES]]


def _misses(A: FloatArray, B: FloatArray, R_X: FloatArray, R_Z: FloatArray) -> FloatArray:
    """Return the (T, M, N) angles by which each robot pose misses each target pose."""
    left = np.swapaxes(R_Z, -1, -2)[:, None] @ A @ R_X[:, None]
    across = np.swapaxes(B, -1, -2).reshape(len(B), 9)
    traces = left.reshape(*left.shape[:2], 9) @ across.T
    return np.asarray(2.0 * np.arcsin(np.sqrt(np.clip((3.0 - traces) / 4.0, 0.0, 1.0))))


def _mutual(misses: FloatArray) -> IntArray:
    """Return the (N,) nearest robot pose of each target pose that it is nearest to as well."""
    nearest = np.argmin(misses, axis=0)
    columns = np.arange(misses.shape[1])
    mutual = np.argmin(misses[nearest], axis=1) == columns
    return np.where(mutual & (misses[nearest, columns] < _MATCH), nearest, -1)
