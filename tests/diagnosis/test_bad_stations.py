"""Faults put into good recordings are found, named and nothing else is; good ones stay good."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, scene, stations, unit

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.bad_findings import findings_of_bad, reasons_of_bad
from handeye_cli.diagnosis.bad_stations import effect_of, find_bad_stations
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise, TargetSpec
from handeye_cli.records.bad_stations import BadKind, BadStation, BadStations, TargetMove, most_bad

LEVELS = {
    "small": Noise(3e-4, 1e-4, 3e-4, 1e-4),
    "middle": Noise(1e-3, 3e-4, 1e-3, 3e-4),
    "large": Noise(3e-3, 1e-3, 3e-3, 1e-3),
}
SCENES = {
    "circle": lambda rng: scene(rng, int(rng.integers(7, 10))),
    "general": lambda rng: general_scene(rng, 12),
    "many": lambda rng: general_scene(rng, 20),
}
NAMES = [f"{i:02d}" for i in range(30)]


def good_chain(rng, perfect, noise, *, covariance=True, setup=Setup.EYE_IN_HAND):
    return chain_of(stations(rng, perfect, noise, with_covariance=covariance, setup=setup))


def shift(rng, mm, deg):
    return se3.from_parts(rotations.exp(np.radians(deg) * unit(rng)), mm * 1e-3 * unit(rng))


def with_moved(rng, chain, rows, mm=0.0, deg=0.0):
    B = chain.B.copy()
    for row in rows:
        B[row] = B[row] @ shift(rng, mm, deg)
    return replace(chain, B=B)


def with_poses_of(chain, order):
    return replace(chain, A=chain.A[order])


def exchanged(chain, *pairs):
    order = np.arange(len(chain.A))
    for i, j in pairs:
        order[[i, j]] = order[[j, i]]
    return with_poses_of(chain, order)


def moved_from(rng, chain, row, mm, deg):
    B = chain.B.copy()
    B[row:] = B[row:] @ shift(rng, mm, deg)
    return replace(chain, B=B)


def some(count, mm, deg):
    """A fault: the plate stood elsewhere at `count` stations."""

    def put(rng, chain):
        rows = sorted(rng.choice(len(chain.A), count, replace=False).tolist())
        return with_moved(rng, chain, rows, mm, deg), (tuple(rows), (), None)

    return put


def exchange(far):
    def put(rng, chain):
        step = len(chain.A) // 2 if far else 1
        i = int(rng.integers(len(chain.A) - step))
        return exchanged(chain, (i, i + step)), ((i, i + step), ((i, i + step),), None)

    return put


def move(part, mm, deg):
    def put(rng, chain):
        row = round(part * len(chain.A))
        return moved_from(rng, chain, row, mm, deg), ((), (), (row - 1, row))

    return put


def misnamed_corners(rng, chain):
    row = int(rng.integers(len(chain.A)))
    to_centre = se3.from_parts(np.eye(3), [0.0125, 0.0125, 0.0])
    turn = se3.from_parts(rotations.exp([0.0, 0.0, np.pi / 2]), np.zeros(3))
    B = chain.B.copy()
    B[row] = B[row] @ to_centre @ turn @ se3.inverse(to_centre)
    return replace(chain, B=B), ((row,), (), None)


FAULTS = {
    "20 mm": some(1, 20.0, 0.0),
    "2 deg": some(1, 0.0, 2.0),
    "two": some(2, 20.0, 2.0),
    "neighbours exchanged": exchange(far=False),
    "opposite exchanged": exchange(far=True),
    "corners": misnamed_corners,
    "moved half way": move(0.5, 20.0, 0.0),
    "moved late": move(0.7, 20.0, 3.0),
    "moved far": move(0.5, 200.0, 60.0),
}
CASES = [
    # Every fault and every scene at every level, by turns with covariances and without.
    (where, fault, list(LEVELS)[(i + k) % 3], (i + k) % 2 == 0)
    for i, where in enumerate(SCENES)
    for k, fault in enumerate(FAULTS)
]


def told(bad):
    rows = tuple(station.row for station in bad.outliers)
    place = None if bad.moved is None else (bad.moved.before, bad.moved.after)
    return rows, bad.exchanged, place


@pytest.mark.parametrize(("where", "fault", "level", "covariance"), CASES)
def test_the_fault_is_found_and_nobody_else(where, fault, level, covariance):
    rng = np.random.default_rng(list(fault.encode()))
    chain = good_chain(rng, SCENES[where](rng), LEVELS[level], covariance=covariance)
    chain, expected = FAULTS[fault](rng, chain)
    assert told(find_bad_stations(chain)) == expected


@pytest.mark.parametrize(("fault", "level"), [((1, 3.0, 0.0), "small"), ((3, 20.0, 2.0), "large")])
def test_small_and_many_faults_are_found(fault, level):
    for seed in range(4):
        rng = np.random.default_rng([seed, 77])
        chain, expected = some(*fault)(rng, good_chain(rng, general_scene(rng, 12), LEVELS[level]))
        assert told(find_bad_stations(chain)) == expected


@pytest.mark.many_runs
def test_good_recordings_stay_good():
    alarms = []
    for seed in range(75):
        rng = np.random.default_rng([seed, 5])
        count, level = 4 + seed % 17, list(LEVELS.values())[seed % 3]
        perfect = scene(rng, count) if seed % 2 else general_scene(rng, count)
        bad = find_bad_stations(good_chain(rng, perfect, level, covariance=seed % 4 < 2))
        alarms += [seed] if bad.outliers or bad.moved else []
    assert len(alarms) <= 2


def anisotropic(rng, count):
    """(N, 6, 6) covariances with axes in all directions and sizes over two orders of magnitude."""
    base = joint_covariance(count, LEVELS["middle"])[:, 6:, 6:]
    root = np.zeros((count, 6, 6))
    for part in (slice(0, 3), slice(3, 6)):
        axes = rotations.exp(rng.normal(size=(count, 3)))
        root[:, part, part] = axes * 10.0 ** rng.uniform(-0.5, 0.8, (count, 1, 3))
    root = root @ np.sqrt(base)
    return root @ np.swapaxes(root, -1, -2)


def test_unequal_known_covariances_are_no_fault():
    alarms = []
    for seed in range(24):
        rng = np.random.default_rng([seed, 6])
        count = 6 + seed % 12
        perfect, covariance = general_scene(rng, count), anisotropic(rng, count)
        chain = good_chain(rng, perfect, LEVELS["middle"])
        B = disturbed(rng, perfect.B, covariance)
        bad = find_bad_stations(replace(chain, B=B, camera_covariance=covariance))
        alarms += [seed] if bad.outliers or bad.moved else []
    assert len(alarms) <= 1


def test_three_stations_cannot_be_told_apart():
    rng = np.random.default_rng(1)
    chain = with_moved(rng, good_chain(rng, scene(rng, 3), LEVELS["small"]), [1], mm=50.0)
    assert find_bad_stations(chain) == BadStations(3)


@pytest.mark.parametrize("count", [4, 5, 6])
def test_of_few_stations_nobody_is_blamed_wrongly(count):
    named = 0
    for seed in range(12):
        rng = np.random.default_rng([seed, count])
        chain = good_chain(rng, scene(rng, count), LEVELS["middle"])
        row = int(rng.integers(count))
        rows, _, place = told(find_bad_stations(with_moved(rng, chain, [row], 20.0, 2.0)))
        assert rows in ((), (row,))
        assert place is None
        named += rows == (row,)
    assert named >= 9


@pytest.mark.parametrize("setup", Setup)
def test_two_exchanged_of_eighteen_are_told_in_either_setup(setup):
    rng = np.random.default_rng(18)
    chain = good_chain(rng, general_scene(rng, 18), LEVELS["middle"], setup=setup)
    bad = find_bad_stations(exchanged(chain, (4, 11)))
    assert told(bad) == ((4, 11), ((4, 11),), None)
    assert {station.kind for station in bad.outliers} == {BadKind.EXCHANGED}
    assert bad.left_out == (4, 11)
    assert 4 not in bad.kept
    assert len(bad.kept) == 16


def test_exchanged_images_of_a_plate_that_looks_turned_as_well_are_told():
    """The wrong robot poses also decided how the plate is turned in these images."""
    rng = np.random.default_rng(21)
    plate = TargetSpec("disc-grid", {"rows": 6, "columns": 6, "spacing_mm": 5, "diameter_mm": 4})
    chain = exchanged(good_chain(rng, general_scene(rng, 14), LEVELS["middle"]), (3, 10))
    quarter = se3.from_parts(rotations.exp(np.array([0.0, 0.0, np.pi / 2])), np.zeros(3))
    away = se3.from_parts(np.eye(3), np.array([0.0125, 0.0125, 0.0]))  # the middle of the plate
    turn = away @ quarter @ se3.inverse(away)
    B = chain.B.copy()
    B[3], B[10] = B[3] @ turn, B[10] @ turn @ turn
    chain = replace(chain, B=B)
    assert told(find_bad_stations(chain)) == ((3, 10), (), None)
    assert told(find_bad_stations(chain, target=plate)) == ((3, 10), ((3, 10),), None)


def test_three_images_passed_round_are_told_in_their_order():
    rng = np.random.default_rng(3)
    chain = good_chain(rng, general_scene(rng, 12), LEVELS["middle"])
    order = np.arange(12)
    order[[1, 4, 8]] = 4, 8, 1  # the image of 4 is with the pose of 8, that of 8 with that of 1
    bad = find_bad_stations(with_poses_of(chain, order))
    assert told(bad) == ((1, 4, 8), ((1, 8, 4),), None)


def test_more_than_a_third_is_not_left_out():
    rng = np.random.default_rng(4)
    chain = good_chain(rng, general_scene(rng, 12), LEVELS["small"])
    bad = find_bad_stations(exchanged(chain, (0, 5), (1, 7), (2, 9)))
    assert bad.exchanged == ((0, 5), (1, 7), (2, 9))
    assert bad.too_many
    assert bad.left_out == ()
    codes = [finding.code for finding in findings_of_bad(bad, NAMES, Setup.EYE_IN_HAND)]
    assert codes == 3 * ["stations-exchanged"] + ["too-many-bad-stations"]


def test_a_bad_station_beside_a_move_is_told_apart_from_it():
    rng = np.random.default_rng(5)
    chain = moved_from(rng, good_chain(rng, general_scene(rng, 12), LEVELS["middle"]), 5, 10.0, 1.0)
    bad = find_bad_stations(with_moved(rng, chain, [2], 30.0))
    assert told(bad) == ((2,), (), (4, 5))
    assert bad.left_out == (0, 1, 2, 3, 4)
    assert bad.moved.translation == pytest.approx(10e-3, rel=0.1)
    assert np.degrees(bad.moved.rotation) == pytest.approx(1.0, rel=0.2)


def test_the_numbers_are_those_of_the_fault():
    rng = np.random.default_rng(6)
    chain = good_chain(rng, general_scene(rng, 12), LEVELS["small"])
    B = chain.B.copy()
    B[7] = B[7] @ se3.from_parts(rotations.exp([0.03, 0.0, 0.0]), [0.0, 0.02, 0.0])
    (station,) = find_bad_stations(replace(chain, B=B)).outliers
    assert station.translation == pytest.approx(20e-3, rel=0.05)
    assert station.rotation == pytest.approx(0.03, rel=0.05)
    # 30 mrad by 0.24 mrad per axis of robot and camera: a hundred and more
    assert station.sigmas > 60.0
    assert station.chance < 1e-9


def test_noise_is_that_of_the_good_stations():
    levels = []
    for seed in range(6):
        rng = np.random.default_rng([seed, 8])
        chain = good_chain(rng, general_scene(rng, 15), LEVELS["middle"])
        bad = find_bad_stations(with_moved(rng, chain, [2, 9], 50.0, 5.0))
        levels.append([bad.scale.robot_rotation, bad.scale.robot_translation])
    rms = np.sqrt(np.mean(np.square(levels), axis=0))
    # of 200 degrees of freedom, half is the camera's share: 15 % per level
    np.testing.assert_allclose(rms, [1e-3, 3e-4], rtol=0.4)


@pytest.mark.parametrize("rows", [(), (3,)])
def test_given_noise_is_used(rows):
    rng = np.random.default_rng(9)
    noise = LEVELS["middle"]
    chain = with_moved(rng, good_chain(rng, general_scene(rng, 10), noise), rows, 10.0)
    bad = find_bad_stations(chain, noise)
    assert told(bad) == (rows, (), None)
    assert bad.scale == noise


def test_noise_given_far_too_small_is_told():
    rng = np.random.default_rng(10)
    chain = good_chain(rng, general_scene(rng, 10), LEVELS["large"])
    bad = find_bad_stations(chain, LEVELS["small"])
    assert bad.too_many
    (finding,) = findings_of_bad(bad, NAMES, Setup.EYE_IN_HAND)
    assert finding.code == "too-many-bad-stations"
    assert "'noise'" in finding.advice


def test_perfect_stations_are_good_and_a_hundredth_of_a_millimetre_is_not():
    rng = np.random.default_rng(11)
    perfect = general_scene(rng, 8)
    chain = replace(
        good_chain(rng, perfect, LEVELS["small"], covariance=False), A=perfect.A, B=perfect.B
    )
    assert told(find_bad_stations(chain)) == ((), (), None)
    assert told(find_bad_stations(with_moved(rng, chain, [5], mm=0.01))) == ((5,), (), None)


def test_stations_in_one_place_do_not_outvote_the_others():
    rng = np.random.default_rng(12)
    perfect = general_scene(rng, 10)
    again = np.array([0, 0, 0, 0, 0, 0, 1, 2, 3, 4])
    perfect = replace(perfect, A=perfect.A[again], B=perfect.B[again])
    chain = good_chain(rng, perfect, LEVELS["middle"])
    assert told(find_bad_stations(with_moved(rng, chain, [8], 30.0, 3.0))) == ((8,), (), None)


def test_hundreds_of_stations():
    rng = np.random.default_rng(13)
    chain = good_chain(rng, general_scene(rng, 600), LEVELS["middle"])
    bad = find_bad_stations(exchanged(with_moved(rng, chain, [40], 40.0, 3.0), (300, 500)))
    assert told(bad) == ((40, 300, 500), ((300, 500),), None)


@pytest.mark.parametrize(("count", "most"), [(3, 0), (4, 1), (6, 1), (7, 2), (12, 4)])
def test_most_bad(count, most):
    assert most_bad(count) == most


def station(row, kind=BadKind.ELSEWHERE):
    return BadStation(row, np.radians(0.42), 21.34e-3, 38.2, 1e-20, kind)


def texts(bad, setup=Setup.EYE_IN_HAND):
    return findings_of_bad(bad, NAMES, setup)


def test_a_bad_station_is_named_with_its_numbers():
    (finding,) = texts(BadStations(12, (station(7),)))
    assert finding.code == "bad-station"
    assert finding.message == (
        'station "07" sees the target 21.3 mm and 0.42 deg away from where all others see it, '
        "38.2 standard deviations"
    )
    assert reasons_of_bad(BadStations(12, (station(7),)), NAMES) == {
        7: "the others contradict it: 21.3 mm and 0.42 deg away from where all others see it, "
        "38.2 standard deviations"
    }


def test_a_turned_target_is_called_misnamed_points():
    (finding,) = texts(BadStations(12, (station(7, BadKind.TURNED),)))
    assert "whole quarters" in finding.message
    assert "named wrongly" in finding.advice


def test_misnamed_corners_are_recognised():
    rng = np.random.default_rng(14)
    chain, _ = misnamed_corners(rng, good_chain(rng, general_scene(rng, 9), LEVELS["middle"]))
    (station,) = find_bad_stations(chain).outliers
    assert station.kind is BadKind.TURNED


@pytest.mark.parametrize(
    ("cycle", "words"),
    [
        ((3, 4), 'of stations "03" and "04" are exchanged'),
        ((3, 8, 4), 'of stations "03", "08" and "04" are interchanged'),
    ],
)
def test_exchanged_stations_are_one_finding(cycle, words):
    outliers = tuple(station(row, BadKind.EXCHANGED) for row in sorted(cycle))
    bad = BadStations(12, outliers, (cycle,))
    (finding,) = texts(bad)
    assert finding.code == "stations-exchanged"
    assert words in finding.message
    assert set(reasons_of_bad(bad, NAMES)) == set(cycle)


@pytest.mark.parametrize("setup", Setup)
def test_a_move_names_both_sides_and_its_size(setup):
    move = TargetMove(5, 6, np.radians(0.5), 12.3e-3, 40.0, (6, 7, 8))
    bad = BadStations(9, moved=move)
    (finding,) = texts(bad, setup)
    assert finding.code == "target-moved"
    assert '12.3 mm and 0.5 deg away from where those up to station "05"' in finding.message
    assert f'moved on its {setup.reference} between stations "05" and "06"' in finding.message
    assert bad.left_out == (6, 7, 8)
    assert reasons_of_bad(bad, NAMES)[7].endswith('between stations "05" and "06"')


def test_many_names_are_cut_short():
    (finding,) = texts(BadStations(30, tuple(station(row) for row in range(20))))
    assert finding.severity == "error"
    assert "20 of 30 stations" in finding.message
    assert '"11" and 8 more;' in finding.message


def test_the_effect_is_the_difference_of_the_answers():
    rng = np.random.default_rng(15)
    everybody = general_scene(rng, 3).X
    without = se3.perturb(everybody, np.array([3e-3, 0.0, 4e-3, 0.0, 0.01, 0.0]))
    effect = effect_of(("07",), everybody, without)
    assert effect.left_out == ("07",)
    assert effect.translation == pytest.approx(5e-3)
    assert effect.rotation == pytest.approx(0.01)
