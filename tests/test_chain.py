"""Stations as arrays of the loop, and what all of them share."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.records import Noise
from handeye_cli.solve import solve

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def document(count, seen, setup=Setup.EYE_IN_HAND):
    """Stations of which only the first ones have a target pose."""
    rng = np.random.default_rng(2)
    whole = stations(rng, general_scene(rng, count), NOISE, setup=setup)
    rows = whole.stations
    blind = tuple(replace(each, camera_T_target=None, reason="fog") for each in rows[seen:])
    return replace(whole, stations=(*rows[:seen], *blind))


@pytest.mark.parametrize(
    ("fewest", "expected"),
    [(1, "at least 1 station with a target pose, found 0 of 5"), (4, "at least 4 stations with")],
)
def test_too_few_stations_are_told_how_many_it_takes(fewest, expected):
    with pytest.raises(UndeterminedError, match=expected):
        chain_of(document(5, fewest - 1), fewest)


@pytest.mark.parametrize("seen", [0, 2])
def test_a_whole_answer_takes_three(seen):
    with pytest.raises(UndeterminedError, match=f"at least 3 stations .*found {seen} of 5"):
        solve(document(5, seen))


@pytest.mark.parametrize("setup", list(Setup))
def test_shared_errors_move_the_poses_they_belong_to(setup):
    rng = np.random.default_rng(5)
    chain = chain_of(document(4, 4, setup))
    shared, by_intrinsics = rng.normal(size=(4, 6)), rng.normal(size=(4, 6, 2))
    chain = replace(chain, shared_error=shared, by_intrinsics=by_intrinsics)
    errors = np.array([0.7, -1.3, 0.4])
    moved = chain.by_causes @ errors
    np.testing.assert_allclose(moved[:, 6:], by_intrinsics @ errors[:2])
    of_robot = np.einsum("nij,nj->ni", chain.by_robot, shared)
    np.testing.assert_allclose(moved[:, :6], 0.4 * of_robot)

    X, Z = chain.A[1], chain.B[1]
    loop = loop_jacobians(chain.A, chain.B, X, Z)
    expected = np.einsum("nij,nj->ni", loop.by_robot, moved[:, :6])
    expected += np.einsum("nij,nj->ni", loop.by_camera, moved[:, 6:])
    np.testing.assert_allclose(chain.by_shared_causes(loop) @ errors, expected)

    influence = rng.normal(size=(4, 3, 12))
    caused = sum(influence[i] @ moved[i] for i in range(4))
    np.testing.assert_allclose(chain.caused(influence) @ errors, caused)


def test_without_any_nothing_is_shared():
    assert chain_of(document(4, 4)).by_causes.shape == (4, 12, 0)
