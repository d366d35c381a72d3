"""The star drawing joins all stations by wide motions, for odd and even numbers."""

import numpy as np
import pytest

from handeye_cli.geometry.star import all_pairs, star_pairs


def joined(count: int, pairs: np.ndarray) -> set[int]:
    """Stations that can be walked to from station 0, by brute force."""
    reached = {0}
    while True:
        touched = [{int(i), int(j)} for i, j in pairs if reached & {int(i), int(j)}]
        grown = reached.union(*touched)
        if grown == reached:
            return reached
        reached = grown


@pytest.mark.parametrize("count", range(3, 41))
def test_every_station_is_joined(count):
    assert joined(count, star_pairs(count)) == set(range(count))


@pytest.mark.parametrize("count", range(3, 41))
def test_pairs_are_distinct_ordered_and_in_range(count):
    pairs = star_pairs(count)
    assert np.all(pairs[:, 0] < pairs[:, 1])
    assert pairs.min() == 0
    assert pairs.max() == count - 1
    assert len({tuple(pair) for pair in pairs}) == len(pairs)
    assert [tuple(p) for p in pairs] == sorted(tuple(p) for p in pairs)


@pytest.mark.parametrize("count", range(3, 41))
def test_every_station_is_used_equally_often(count):
    uses = np.bincount(star_pairs(count).ravel(), minlength=count)
    assert set(uses) <= {2, 3}
    assert len(set(uses)) == 1


@pytest.mark.parametrize("count", range(3, 41))
def test_partners_lie_at_most_one_step_short_of_opposite(count):
    gap = np.diff(star_pairs(count), axis=1)[:, 0]
    assert np.all(np.minimum(gap, count - gap) >= (count - 1) // 2)


@pytest.mark.parametrize(
    ("count", "expected"),
    [
        (3, [(0, 1), (0, 2), (1, 2)]),
        (4, [(0, 1), (0, 3), (1, 2), (2, 3)]),
        (5, [(0, 2), (0, 3), (1, 3), (1, 4), (2, 4)]),
        (6, [(0, 2), (0, 3), (0, 4), (1, 3), (1, 4), (1, 5), (2, 4), (2, 5), (3, 5)]),
    ],
)
def test_small_stars_by_hand(count, expected):
    assert [tuple(pair) for pair in star_pairs(count)] == expected


@pytest.mark.parametrize("count", [-1, 0, 1, 2])
def test_too_few_stations_are_refused(count):
    with pytest.raises(ValueError, match=f"at least 3 stations, found {count}"):
        star_pairs(count)


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_all_pairs_against_a_double_loop(count):
    expected = [(i, j) for i in range(count) for j in range(i + 1, count)]
    assert [tuple(pair) for pair in all_pairs(count)] == expected
