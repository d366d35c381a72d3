"""An error that the robot poses of all stations share, as that of a time offset, in the answer."""

from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from moving_scenes import CAMERA, Run, X

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry import se3
from handeye_cli.part_calibration import noise_of_others
from handeye_cli.records import Noise, Station, Stations, UncertainPose
from handeye_cli.solve import solve
from handeye_cli.solve_determined import solve_determined
from handeye_cli.solvers import Solution

TRIALS = 60
SIGMA = 2e-3
"""Standard deviation of the time, seconds: robots here go at 0.2 m/s."""
NOISE = 0.05
"""Of the poses, as a part of the usual."""
PARTS = {"rotation": slice(3, 6), "translation": slice(0, 3)}


def run_of(setup):
    """Return a robot in motion, and what its camera saw on the way."""
    run = Run(np.random.default_rng(1), setup=setup, views=12, noise=NOISE)
    return run, run.moving_views()


def moved(run, seen, offset=0.0):
    """Return the stations at times that are all off by an offset, the camera's poses by noise."""
    times = seen.times + run.offset + offset
    scatter = run.rng.normal(0.0, NOISE * CAMERA, (len(times), 6))
    rows = zip(
        seen.path.at(times),
        seen.path.velocities(times),
        se3.perturb(run.seen(seen.times + run.offset), scatter),
        seen.covariance,
        strict=True,
    )
    return Stations(
        run.setup,
        tuple(
            Station(
                f"{index:02d}",
                pose,
                camera_T_target=UncertainPose(B, covariance),
                shared_error=SIGMA * velocity,
            )
            for index, (pose, velocity, B, covariance) in enumerate(rows)
        ),
    )


def estimated(stations):
    chain = chain_of(stations)
    return best_estimate(chain, choose_pairs("star", len(chain.A)), stations, "maximum-likelihood")


@pytest.mark.parametrize("setup", list(Setup))
def test_the_answer_is_as_uncertain_as_a_dominating_time_makes_it(setup):
    run, seen = run_of(setup)
    # evenly over the normal distribution: as good as thousands of random ones
    chances = (np.arange(TRIALS) + 0.5) / TRIALS
    offsets = [NormalDist(0.0, SIGMA).inv_cdf(chance) for chance in chances]
    found = [estimated(moved(run, seen, offset)) for offset in offsets]
    away = np.array([se3.difference(each.solution.X, X) for each in found])
    covariances = np.array([each.covariance[:6, :6] for each in found])
    shared = np.array([each.shared[:6, :6] for each in found])
    for part in PARTS.values():
        predicted = np.einsum("nii->", covariances[:, part, part])
        assert np.einsum("nii->", shared[:, part, part]) > 0.8 * predicted
        assert 0.9 < np.sqrt(np.sum(away[:, part] ** 2) / predicted) < 1.1


def test_every_way_to_an_answer_counts_it():
    """The calibration's own prediction, and that of a partial answer, are wider by the same."""
    stations = moved(*run_of(Setup.EYE_IN_HAND))
    noise = Noise(1e-4, 1e-4)
    known = replace(stations, noise=noise)
    silent = replace(
        known, stations=tuple(replace(each, shared_error=None) for each in known.stations)
    )
    added = estimated(known).shared[:6, :6]
    for way in (solve, solve_determined):
        wide, narrow = (way(each).mount_T_camera.covariance for each in (known, silent))
        np.testing.assert_allclose(wide - narrow, added, atol=1e-6 * np.abs(added).max())


def test_stations_that_took_no_part_have_their_own_share():
    stations = moved(*run_of(Setup.EYE_TO_HAND))
    chain = chain_of(stations)
    silent = replace(chain, shared_error=None)
    given = Noise(1e-3, 1e-4)
    with_it, without = (
        noise_of_others(each, given, given, Solution(np.eye(4), np.eye(4)))
        for each in (chain, silent)
    )
    errors = np.array(
        [
            turn @ each.shared_error
            for turn, each in zip(chain.by_robot, stations.stations, strict=True)
        ]
    )
    added = errors[:, :, None] * errors[:, None, :]
    np.testing.assert_allclose((with_it - without)[:, :6, :6], added, atol=1e-15)


def test_a_part_of_a_chain_has_the_errors_of_its_stations():
    stations = moved(*run_of(Setup.EYE_IN_HAND))
    entries = list(stations.stations)
    entries[2] = replace(entries[2], shared_error=None)
    part = chain_of(replace(stations, stations=tuple(entries))).part(np.array([2, 4]))
    np.testing.assert_array_equal(part.shared_error, [np.zeros(6), entries[4].shared_error])
