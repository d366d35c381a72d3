"""Places on a lattice that was taken apart and put together again."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.targets.lattice_walk import joined_parts

STEPS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])


def taken_apart(places, rng):
    """The neighbours of shuffled points, each seen along its own turned cross."""
    index = {tuple(place): k for k, place in enumerate(places.tolist())}
    turns = rng.integers(0, 4, len(places))
    table = np.full((len(places), 4), -1)
    for k, place in enumerate(places):
        for direction, step in enumerate(STEPS):
            table[k, (direction - turns[k]) % 4] = index.get(tuple((place + step).tolist()), -1)
    return table


def same_up_to_a_turn(found, places):
    """Whether places are the same but for a shift and a quarter turn, mirrored not."""
    turned = found
    for _ in range(4):
        if np.array_equal(turned - turned.min(axis=0), places - places.min(axis=0)):
            return True
        turned = turned @ np.array([[0, 1], [-1, 0]])
    return False


@pytest.mark.parametrize("seed", range(3))
def test_every_part_is_put_together(seed):
    rng = np.random.default_rng(seed)
    large = np.stack(np.meshgrid(np.arange(7), np.arange(4)), axis=-1).reshape(-1, 2)
    small = np.stack(np.meshgrid(np.arange(3), np.arange(2)), axis=-1).reshape(-1, 2) + 20
    places = rng.permutation(np.concatenate([large, small, [[50, 50], [51, 50]]]))
    parts = joined_parts(taken_apart(places, rng))
    assert [len(members) for members, _ in parts] == [28, 6]
    for members, found in parts:
        assert same_up_to_a_turn(found, places[members])


def test_neighbours_that_do_not_see_each_other_are_not_joined():
    rng = np.random.default_rng(5)
    places = np.stack(np.meshgrid(np.arange(4), np.arange(2)), axis=-1).reshape(-1, 2)
    table = taken_apart(places, rng)
    left = {k for k, place in enumerate(places.tolist()) if place[0] < 2}
    for k in left:
        table[k, [there not in left for there in table[k]]] = -1
    parts = joined_parts(table)
    assert sorted(len(members) for members, _ in parts) == [4, 4]


def test_nothing_is_no_part():
    assert joined_parts(np.zeros((0, 4), dtype=np.int64)) == []
    assert joined_parts(np.full((5, 4), -1)) == []
