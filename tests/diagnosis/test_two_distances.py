"""A target of a wrong size, seen from two distances: neither moved, nor a fault of a joint."""

import numpy as np
import pytest
from scenes import Scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.bad_stations import find_bad_stations
from handeye_cli.diagnosis.systematic import systematic_errors
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry import se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Noise

NOISE = Noise(2e-4, 5e-5, 3e-5, 2e-6)
ONE_AFTER_THE_OTHER = np.arange(12)
BY_TURNS = np.arange(12).reshape(2, 6).T.ravel()


def two_circles(order, *, larger=1.0, away=0.6):
    """Two circles of stations, whose target is `larger` than declared; the base is `away`."""
    near = generate_stations(6, 0.09, np.radians(30.0))
    far = generate_stations(6, 0.13, np.radians(20.0))
    B = se3.inverse(np.concatenate([near, far])[order])
    X = se3.from_parts(np.eye(3), np.array([0.11, -0.12, 0.18]))
    Z = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.array([away, 0.1, 0.0]))
    A = Z @ se3.inverse(X @ B)
    B[:, :3, 3] /= larger
    return Scene(A, B, X, Z)


def recorded(seed, *layout, **how):
    return stations(np.random.default_rng(seed), two_circles(*layout, **how), NOISE)


@pytest.mark.parametrize("larger", [0.98, 1.005, 1.02])
@pytest.mark.parametrize("order", [ONE_AFTER_THE_OTHER, BY_TURNS], ids=["one by one", "by turns"])
def test_a_wrong_size_does_not_speak_against_single_stations(order, larger):
    found = find_bad_stations(chain_of(recorded(1, order, larger=larger)))
    assert found.moved is None
    assert not found.outliers
    assert not found.exchanged


@pytest.mark.parametrize("away", [0.1, 0.6, 10.0])
@pytest.mark.parametrize("larger", [0.98, 1.02])
def test_a_wrong_size_is_called_one_wherever_the_base_is(away, larger):
    document = recorded(2, BY_TURNS, larger=larger, away=away)
    chain = chain_of(document)
    found = best_estimate(chain, choose_pairs("star", 12), document, "maximum-likelihood")
    (finding,) = systematic_errors(found, chain, None, Setup.EYE_IN_HAND).findings
    percent = float(finding.message.split(" its ways are ")[1].split(" %")[0])
    sigma = float(finding.message.split("(+- ")[1].split(")")[0])
    assert abs(percent - 100 * abs(larger - 1.0)) < 4 * sigma
    assert f"a target {'larger' if larger > 1.0 else 'smaller'} than declared" in finding.message


def test_a_target_that_moved_between_two_distances_is_still_said_to_have_moved():
    document = recorded(3, ONE_AFTER_THE_OTHER)
    chain = chain_of(document)
    chain.B[6:] = chain.B[6:] @ se3.from_parts(np.eye(3), np.array([2e-3, 0.0, 0.0]))
    moved = find_bad_stations(chain).moved
    assert moved is not None
    assert (moved.before, moved.after) == (5, 6)
