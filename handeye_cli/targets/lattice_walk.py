"""Places on a square lattice, from who is whose neighbour."""

from __future__ import annotations

import numpy as np

from handeye_cli.records import IntArray

_STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
_ONES = np.ones(len(_STEPS), dtype=np.int64)


def joined_parts(neighbours: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Return the joined parts of a lattice with their places, the largest first.

    Only neighbours that see each other are joined.

    Args:
        neighbours: (n, 4) indices of the neighbours in the directions of each point's own cross, in
            the order in which x turns to y, or -1.

    Returns:
        (m,) points and their (m, 2) whole-numbered places of every part of 4 points or more; the
        axes of the places turn as the crosses do.
    """
    table = neighbours.tolist()
    free = set(range(len(table)))
    parts = []
    degrees = (neighbours >= 0) @ _ONES
    for seed in np.argsort(-degrees, kind="stable")[: np.count_nonzero(degrees >= 2)].tolist():
        if seed in free:
            places = _walk(table, seed, free)
            if len(places) >= len(_STEPS):
                parts.append((np.array(list(places)), np.array(list(places.values()))))
    return sorted(parts, key=lambda part: -len(part[0]))


def _walk(table: list[list[int]], seed: int, free: set[int]) -> dict[int, tuple[int, int]]:
    """Return the places of the points that are joined with a seed, which are free no longer."""
    places, turns, taken = {seed: (0, 0)}, {seed: 0}, {(0, 0)}
    free.remove(seed)
    queue = [seed]
    # it grows while it is read: breadth first
    for here in queue:
        (x, y), turn = places[here], turns[here]
        for k, there in enumerate(table[here]):
            if there not in free or here not in table[there]:
                continue
            direction = (k + turn) % 4
            place = (x + _STEPS[direction][0], y + _STEPS[direction][1])
            if place not in taken:
                # Seen from there, the way back is the opposite of the way here.
                turns[there] = (direction + 2 - table[there].index(here)) % 4
                places[there] = place
                taken.add(place)
                free.remove(there)
                queue.append(there)
    return places
