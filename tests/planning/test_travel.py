"""The shortest way against trying all of them."""

from itertools import permutations

import numpy as np
import pytest

from handeye_cli.geometry import rotations, se3
from handeye_cli.planning import travel


def random_poses(count, seed):
    rng = np.random.default_rng(seed)
    return se3.from_parts(
        rotations.exp(0.5 * rng.normal(size=(count, 3))), 0.2 * rng.normal(size=(count, 3))
    )


@pytest.mark.parametrize("seed", range(20))
def test_it_is_nearly_the_shortest_of_all_ways(seed):
    poses = random_poses(7, seed)
    cost = travel.motions(poses)
    way = travel.shortest_way(poses)
    assert way[0] == 0
    assert sorted(way) == list(range(7))
    best = min(travel.length(cost, [0, *rest]) for rest in permutations(range(1, 7)))
    assert travel.length(cost, way) <= 1.02 * best


def test_stations_along_a_line_are_visited_in_their_order():
    poses = se3.from_parts(np.eye(3), np.outer([0.0, 0.3, 0.1, 0.4, 0.2], [1.0, 0.0, 0.0]))
    assert travel.shortest_way(poses) == [0, 2, 4, 1, 3]


def test_motion_is_turn_and_travel():
    turns = rotations.exp(np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]]))
    poses = se3.from_parts(turns, np.array([[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]]))
    assert travel.motions(poses)[0, 1] == pytest.approx(0.5 + 0.15 / 0.3)


def test_it_is_shorter_than_going_to_the_nearest_each_time():
    for seed in range(5):
        cost = travel.motions(random_poses(40, seed))
        first = travel._nearest_first(cost, [0])
        assert travel.length(cost, travel.shortest_way(random_poses(40, seed))) < 0.95 * (
            travel.length(cost, first)
        )


@pytest.mark.parametrize("count", [1, 2, 300])
def test_few_and_many(count):
    assert sorted(travel.shortest_way(random_poses(count, 1))) == list(range(count))
