"""An error that the robot poses of all stations share, as that of a time offset, in the answer."""

from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from moving_scenes import CAMERA, Run, X
from pictures import CAMERA as CAMERA_OF_PICTURES
from pictures import shoot
from scenes import calibrated

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.answered_stations import AnsweredStations
from handeye_cli.diagnosis.bad_stations import find_bad_stations
from handeye_cli.diagnosis.held_noise import held_noise
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import se3
from handeye_cli.geometry.free_directions import NOTHING_FREE
from handeye_cli.leave_one_out import leave_one_out
from handeye_cli.noise_levels import noise_model
from handeye_cli.part_calibration import calibrate_part, usable_chain
from handeye_cli.records import Noise, Station, Stations, UncertainPose
from handeye_cli.solve import solve
from handeye_cli.solve_determined import solve_determined
from handeye_cli.verify import verify, verify_calibration

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


OFFSETS = [NormalDist(0.0, SIGMA).inv_cdf((i + 0.5) / 24) for i in range(24)]
"""Evenly over the distribution of a time's error."""


def ratios(rows):
    """Return RMS errors over their prediction: rotation and translation of held-out stations."""
    seen = [[row.rotation**2, row.translation**2] for row in rows]
    promised = [[row.predicted_rotation**2, row.predicted_translation**2] for row in rows]
    return np.sqrt(np.mean(seen, axis=0) / np.mean(promised, axis=0))


def halves(stations):
    """Return the first six stations, and the others."""
    return (
        replace(stations, stations=stations.stations[part]) for part in (slice(6), slice(6, 12))
    )


@pytest.mark.parametrize("setup", list(Setup))
def test_held_out_stations_of_the_same_recording_are_off_by_the_same_time(setup):
    """What answer and station share partly cancels; neither more nor less is predicted."""
    run, seen = run_of(setup)
    rows = [verify(moved(run, seen, offset)).rows[0] for offset in OFFSETS]
    np.testing.assert_allclose(ratios(rows), 1.0, atol=0.1)
    assert all(row.consistent for row in rows)


def test_a_station_left_out_is_off_by_the_same_time_as_all_others():
    run, seen = run_of(Setup.EYE_TO_HAND)
    rows = [leave_one_out(moved(run, seen, offset)).rows[0] for offset in OFFSETS[::4]]
    np.testing.assert_allclose(ratios(rows), 1.0, atol=0.15)


@pytest.mark.parametrize("target_moved", [False, True])
def test_new_stations_are_off_by_a_time_of_their_own(target_moved):
    run, seen = run_of(Setup.EYE_TO_HAND)
    rows = []
    for i, offset in enumerate(OFFSETS):
        calibration = calibrated(next(halves(moved(run, seen, offset))))
        _, new = halves(moved(run, seen, OFFSETS[17 * i % len(OFFSETS)]))
        rows += verify_calibration(new, calibration, target_moved=target_moved).rows
    np.testing.assert_allclose(ratios(rows), 1.0, atol=0.1)


@pytest.mark.parametrize("setup", list(Setup))
def test_the_covariance_of_a_part_is_that_of_brute_force(setup):
    """X, the mean Z and the shared error itself, moved by the error and solved again."""
    run, seen = run_of(setup)
    first, _ = halves(moved(run, seen))
    first = replace(first, noise=Noise(1e-4, 1e-4))

    def part_at(step):
        entries = tuple(
            replace(each, base_T_gripper=se3.perturb(each.base_T_gripper, step * each.shared_error))
            for each in first.stations
        )
        document = replace(first, stations=entries)
        chain = usable_chain(document)
        return calibrate_part(
            chain, document, method="maximum-likelihood", pairs="star", where="here"
        )

    here, up, down = (part_at(step) for step in (0.0, 0.1, -0.1))
    moves = [
        se3.difference(getattr(up.solution, name), getattr(down.solution, name)) / 0.2
        for name in ("X", "Z")
    ]
    caused = np.concatenate([*moves, [1.0]])
    np.testing.assert_allclose(
        here.shared, np.outer(caused, caused), atol=2e-3 * np.max(np.abs(caused)) ** 2
    )


def test_an_answer_of_dominating_times_is_not_called_a_robots_error():
    """The pattern of the shared error is known, so residuals along it say nothing of the robot."""
    run = Run(np.random.default_rng(2), views=30, noise=NOISE)
    seen = run.moving_views()
    found = {}
    for known in (True, False):
        stations = moved(run, seen, 3.0 * SIGMA)
        if not known:
            entries = (replace(each, shared_error=None) for each in stations.stations)
            stations = replace(stations, stations=tuple(entries))
        estimate = estimated(replace(stations, noise=Noise(1e-5, 4e-6)))
        chain = chain_of(stations)
        found[known] = AnsweredStations.of(estimate, chain, run.setup).white()
    squares = {known: float(white.left @ white.left) for known, white in found.items()}
    assert squares[True] < 2.0 * found[True].freedom
    assert squares[False] > 5.0 * found[False].freedom


@pytest.mark.parametrize("given", [None, Noise(1e-5, 4e-6)])
def test_stations_are_not_bad_for_what_all_of_them_share(given):
    run = Run(np.random.default_rng(2), views=20, noise=NOISE)
    stations = moved(run, run.moving_views(), 2.0 * SIGMA)
    assert not find_bad_stations(chain_of(stations), given).outliers
    entries = list(stations.stations)
    off = np.array([0.0, 0.0, 0.0, 0.1, 0.1, 0.0])
    entries[4] = replace(entries[4], base_T_gripper=se3.perturb(entries[4].base_T_gripper, off))
    found = find_bad_stations(chain_of(replace(stations, stations=tuple(entries))), given)
    assert [each.row for each in found.outliers] == [4]


def test_a_partial_answer_takes_its_noise_from_what_times_do_not_explain():
    """Held noise, like that of a whole answer, is that of the stations alone."""
    run, seen = run_of(Setup.EYE_IN_HAND)
    chain = chain_of(moved(run, seen, 3.0 * SIGMA))
    whole = estimated(moved(run, seen, 3.0 * SIGMA)).solution
    silent = replace(chain, shared_error=None)
    levels = {
        known: held_noise(each, None, whole, NOTHING_FREE).noise.robot_translation
        for known, each in ((True, chain), (False, silent))
    }
    assert levels[False] > 3.0 * levels[True]
    expected = noise_model(chain, None, whole).noise.robot_translation
    assert levels[True] == pytest.approx(expected, rel=1e-6)


def test_a_part_of_a_chain_has_the_errors_of_its_stations():
    stations = moved(*run_of(Setup.EYE_IN_HAND))
    entries = list(stations.stations)
    entries[2] = replace(entries[2], shared_error=None)
    part = chain_of(replace(stations, stations=tuple(entries))).part(np.array([2, 4]))
    np.testing.assert_array_equal(part.shared_error, [np.zeros(6), entries[4].shared_error])


def test_advice_does_not_take_a_times_error_for_that_of_the_intrinsics():
    shot = shoot(np.random.default_rng(4), 8, sigma_px=0.05, robot=(1e-4, 1e-5))
    camera = replace(CAMERA_OF_PICTURES, covariance=np.diag([1e-4] * 4 + [0.0] * 5))
    known = extrinsics(replace(shot.features, camera=camera))
    speeds = np.random.default_rng(5).normal(size=(8, 6)) * np.repeat([5e-4, 5e-3], 3)
    entries = tuple(
        replace(each, shared_error=speed)
        for each, speed in zip(known.stations, speeds, strict=True)
    )
    answer = solve(replace(known, stations=entries, noise=Noise(1e-4, 1e-5)))
    assert answer.predicted_error.rotation > 5.0 * solve(known).predicted_error.rotation
    assert "intrinsics" not in {each.change for each in answer.improvements}
