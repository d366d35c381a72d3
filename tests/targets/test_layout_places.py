"""Layouts on lattices of which some places are seen."""

import numpy as np
import pytest

from handeye_cli.targets.layout_places import best_places


@pytest.mark.parametrize("seed", range(5))
def test_the_places_are_those_found_by_trying_all(seed):
    rng = np.random.default_rng(seed)
    layout = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]])
    places = np.argwhere(rng.random((6, 7)) < 0.6) - 3
    taken = set(map(tuple, places.tolist()))
    covered = {}
    for quarter in range(2):
        turned = layout if quarter == 0 else layout[:, ::-1]
        for corner in np.ndindex(20, 20):
            cells = turned + corner - np.array([10, 10])
            key = frozenset(map(tuple, cells.tolist()))
            covered[key] = len(key & taken)
    found, most = best_places(layout, places)
    assert most == max(covered.values())
    best = {key for key, count in covered.items() if count == most}
    assert {frozenset(map(tuple, each.tolist())) for each in found} == best
    assert len(found) == len(best)
    for each in found:
        axes = np.array([each[1] - each[0], each[3] - each[0]])
        assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize("quarter", range(4))
def test_a_layout_that_was_seen_whole_has_one_position(quarter):
    layout = np.array([[0, 0], [1, 0], [2, 0], [0, 1]])
    turned = layout @ np.linalg.matrix_power([[0, 1], [-1, 0]], quarter) + [-4, 7]
    seen = np.random.default_rng(quarter).permutation(turned)
    (found,), most = best_places(layout, seen)
    assert most == 4
    np.testing.assert_array_equal(found, turned)
    # one more place beside it, and it is sought there as well
    (found,), most = best_places(layout, np.concatenate([seen, [[3, 3]]]))
    assert most == 4
    np.testing.assert_array_equal(found, turned)


def test_a_large_layout_on_few_places_is_told_by_some_of_its_positions():
    layout = np.argwhere(np.ones((70, 60), dtype=bool))
    seen = np.array([[5, 5], [6, 5], [6, 6], [7, 8]])
    found, most = best_places(layout, seen)
    assert most == 4
    # in each of two turns, of some four thousand positions
    assert 4 <= len(found) < 30
    taken = set(map(tuple, seen.tolist()))
    for each in found:
        assert taken <= set(map(tuple, each.tolist()))
    corners = np.array([each.min(axis=0) for each in found])
    np.testing.assert_array_equal(corners.max(axis=0), seen.min(axis=0))
