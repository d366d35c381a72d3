"""Stations along a robot's way, whose errors change little from one to the next."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.diagnosis.bad_stations import find_bad_stations
from handeye_cli.geometry import se3
from handeye_cli.records import Noise

COUNT = 20
PLACES = 7
"""Where the robot's errors are drawn; between them they are mixtures of two."""
SIZES = np.repeat([5e-5, 2e-4], 3) / np.sqrt(3)
CAMERA = Noise(1e-7, 1e-7, 3e-5, 2e-6)


def along_a_way(seed):
    rng = np.random.default_rng(seed)
    perfect = general_scene(rng, COUNT)
    drawn = rng.normal(0.0, SIZES, (PLACES, 6))
    at = np.linspace(0, PLACES - 1, COUNT)
    errors = np.stack([np.interp(at, np.arange(PLACES), each) for each in drawn.T], axis=1)
    document = stations(rng, replace(perfect, A=se3.perturb(perfect.A, errors)), CAMERA)
    return chain_of(document)


def in_motion(chain):
    return replace(chain, shared_error=np.full((len(chain.A), 6), 1e-9))


@pytest.mark.parametrize("seed", [14, 15, 25, 37])
def test_errors_that_wander_do_not_move_the_target(seed):
    chain = along_a_way(seed)
    assert find_bad_stations(chain).moved is not None
    assert find_bad_stations(in_motion(chain)).moved is None


def test_a_target_that_moved_is_still_named():
    chain = along_a_way(0)
    chain.B[11:] = chain.B[11:] @ se3.from_parts(np.eye(3), np.array([2e-3, 0.0, 0.0]))
    moved = find_bad_stations(in_motion(chain)).moved
    assert (moved.before, moved.after) == (10, 11)
