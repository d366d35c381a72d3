"""The way through the stations: straight, smooth, at rest where it says so, and never too fast."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.simulate.motion import SECOND_NS, SpeedLimits, Timetable, along, timetable

START = 1_700_000_000 * SECOND_NS
PAUSE = SECOND_NS // 2


def poses(count: int, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    R = rotations.exp(rng.normal(0.0, 0.5, (count, 3)))
    return se3.from_parts(R, rng.normal(0.0, 0.3, (count, 3)))


def travelled(stations: np.ndarray, **options) -> Timetable:
    return timetable(
        lambda places: along(stations, places),
        len(stations),
        pause_ns=PAUSE,
        start_ns=START,
        **options,
    )


def test_along_interpolates_as_scipy_does():
    stations = poses(5)
    places = np.sort(np.random.default_rng(1).uniform(0.0, 4.0, 50))
    found = along(stations, places)
    slerp = Slerp(np.arange(5), Rotation.from_matrix(stations[:, :3, :3]))
    assert found[:, :3, :3] == pytest.approx(slerp(places).as_matrix(), abs=1e-12)
    for axis in range(3):
        straight = np.interp(places, np.arange(5), stations[:, axis, 3])
        assert found[:, axis, 3] == pytest.approx(straight, abs=1e-14)


def test_a_station_is_a_place_without_any_rounding():
    stations = poses(4)
    assert along(stations, np.arange(3.0)) == pytest.approx(stations[:3], abs=1e-15)
    assert along(stations, np.array([3.0])) == pytest.approx(stations[3:], abs=1e-15)


def test_a_single_station_is_a_single_pause():
    table = travelled(poses(1))
    assert (table.arrivals_ns.tolist(), table.departures_ns.tolist()) == ([START], [START + PAUSE])
    assert table.places(table.ticks(100.0)).tolist() == [0.0] * 51


def test_robot_rests_at_whole_places_for_the_pause_and_moves_between():
    table = travelled(poses(4))
    assert (table.departures_ns - table.arrivals_ns).tolist() == [PAUSE] * 4
    for station in range(4):
        within = table.arrivals_ns[station] + np.arange(9) * PAUSE // 8
        assert table.places(within).tolist() == [station] * 9
    between = table.places((table.departures_ns[:-1] + table.arrivals_ns[1:]) // 2)
    assert between == pytest.approx([0.5, 1.5, 2.5], abs=1e-6)
    assert table.places(np.array([START - SECOND_NS, START + 10**12])).tolist() == [0.0, 3.0]


def test_motion_has_no_jump_in_place_speed_or_acceleration():
    table = travelled(poses(3))
    step = 1e-3
    times = table.arrivals_ns[0] + np.arange(
        0, int(table.departures_ns[-1] - table.arrivals_ns[0]), int(step * 1e9)
    )
    places = table.places(times)
    assert np.all(np.diff(places) >= 0.0)
    speed = np.gradient(places, step)
    acceleration = np.gradient(speed, step)
    shortest = np.diff(np.stack([table.departures_ns[:-1], table.arrivals_ns[1:]]), axis=0).min()
    seconds = shortest / 1e9
    # The polynomial's own extremes, by hand: 15/8, 10/sqrt(3) and 60 over powers of the duration.
    assert speed.max() == pytest.approx(15 / 8 / seconds, rel=0.01)
    assert np.abs(acceleration).max() == pytest.approx(10 / np.sqrt(3) / seconds**2, rel=0.01)
    assert np.abs(np.diff(acceleration)).max() < 1.05 * 60 / seconds**3 * step


@pytest.mark.parametrize("limits", [SpeedLimits(0.1, 100.0), SpeedLimits(100.0, 0.3)])
def test_one_limit_is_reached_and_neither_is_broken(limits):
    stations = poses(5)
    table = travelled(stations, limits=limits)
    times = np.arange(START, table.departures_ns[-1], 2_000_000)
    path = along(stations, table.places(times))
    seconds = np.diff(times) / 1e9
    speed = np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1) / seconds
    turn = Rotation.from_matrix(path[:-1, :3, :3]).inv() * Rotation.from_matrix(path[1:, :3, :3])
    rate = turn.magnitude() / seconds
    assert max(speed.max() / limits.speed, rate.max() / limits.turn_rate) == pytest.approx(
        1.0, abs=0.01
    )


def test_a_way_that_bends_is_limited_where_it_is_fastest():
    def bent(places):
        # a station apart in all, but the second half of each motion is three times as long
        share = places % 1.0
        x = np.floor(places) + np.where(share < 0.5, 0.5 * share, 1.5 * share - 0.5)
        return se3.from_parts(np.eye(3), np.stack([x, 0 * x, 0 * x], axis=1))

    table = timetable(bent, 2, pause_ns=PAUSE, limits=SpeedLimits(1.0, 1.0))
    assert table.arrivals_ns[1] - table.departures_ns[0] == pytest.approx(1.5 * 15 / 8 * 1e9)


def test_a_robot_that_hardly_moves_takes_its_time():
    still = np.repeat(np.eye(4)[None], 3, axis=0)
    table = travelled(still)
    assert (table.arrivals_ns[1:] - table.departures_ns[:-1]).tolist() == [300_000_000] * 2


def test_ticks_are_whole_nanoseconds_without_drift():
    table = travelled(poses(6))
    ticks = table.ticks(30.0)
    assert ticks.dtype == np.int64
    assert ticks[0] == START
    assert table.departures_ns[-1] - 33_333_334 < ticks[-1] <= table.departures_ns[-1]
    assert np.abs(ticks - START - np.arange(len(ticks)) * 1e9 / 30.0).max() <= 0.5


@pytest.mark.parametrize("rate", [0.0, -5.0, float("nan")])
def test_a_rate_that_never_ticks_is_refused(rate):
    with pytest.raises(UsageError, match=f"found {rate:g} Hz"):
        travelled(poses(2)).ticks(rate)


@pytest.mark.parametrize(
    ("pause", "limits", "found"),
    [
        (0, SpeedLimits(), "0 s"),
        (-SECOND_NS, SpeedLimits(), "-1 s"),
        (1, SpeedLimits(speed=0.0), "0 m/s"),
        (1, SpeedLimits(turn_rate=-2.0), "-2 rad/s"),
    ],
)
def test_what_gets_nowhere_is_refused(pause, limits, found):
    with pytest.raises(UsageError, match=found):
        timetable(lambda places: along(poses(3), places), 3, pause_ns=pause, limits=limits)
