"""The table of faults: how they are written, and what each does to the staging."""

import numpy as np
import pytest

from handeye_cli.errors import UsageError
from handeye_cli.simulate.faults import FAULTS, Staging, parse, stage

NAMES = ("00", "01", "02", "03", "04")


def staged(*texts: str) -> Staging:
    return stage(NAMES, [parse(text) for text in texts])


@pytest.mark.parametrize("name", FAULTS)
def test_every_example_can_be_staged(name):
    row = FAULTS[name]
    assert row.example.startswith(f"{name}:")
    assert row.usage.startswith(f"{name}:")
    names = [f"{k:02d}" for k in range(9)]
    before, after = (stage(names, faults) for faults in ([], [parse(row.example)]))
    changed = [key for key in vars(before) if np.any(getattr(before, key) != getattr(after, key))]
    assert len(changed) == 1


def test_without_a_fault_all_is_as_declared():
    staging = staged()
    assert staging.names == NAMES
    assert not staging.target_shift.any()
    assert staging.pictured.tolist() == [0, 1, 2, 3, 4]
    assert not staging.missing.any()
    assert (staging.robot_scale, staging.print_scale) == (1.0, 1.0)
    assert (staging.bow, staging.image_lag_ns) == (0.0, 0)


def test_a_plate_stays_where_it_was_moved_to():
    assert staged("moved-plate:2:20mm").target_shift[:, 0].tolist() == [0.0, 0.0, 0.02, 0.02, 0.02]
    back = staged("moved-plate:2:20mm", "moved-plate:03:-20mm")
    assert back.target_shift[:, 0].tolist() == [0.0, 0.0, 0.02, 0.0, 0.0]
    assert not back.target_shift[:, 1:].any()


def test_swapped_pictures_are_those_of_the_other_station():
    assert staged("swapped:1,03").pictured.tolist() == [0, 3, 2, 1, 4]
    # one after the other: what lies under 3 by then goes to 4
    assert staged("swapped:1,3", "swapped:3,4").pictured.tolist() == [0, 3, 2, 4, 1]


def test_dropped_pictures_are_missing():
    assert np.flatnonzero(staged("dropped:1,4", "dropped:0").missing).tolist() == [0, 1, 4]


def test_scales_multiply_and_lengths_and_times_add():
    staging = staged("scaled:1.25", "scaled:0.8", "robot-scale:1.003", "robot-scale:2")
    assert (staging.print_scale, staging.robot_scale) == pytest.approx((1.0, 2.006))
    staging = staged("bowed:1mm", "bowed:-0.25mm", "time-offset:40ms", "time-offset:-50ms")
    assert staging.bow == pytest.approx(0.75e-3)
    assert staging.image_lag_ns == -10_000_000


def test_stations_go_by_their_names():
    staging = stage(["left", "right", "07"], [parse("dropped:left,7")])
    assert staging.missing.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("text", "found", "hint"),
    [
        ("moved-plat:5:20mm", "found 'moved-plat'", "did you mean moved-plate:STATION:LENGTH"),
        ("earthquake", "found 'earthquake'", "such as moved-plate:5:20mm"),
        ("", "found ''", "such as"),
        ("swapped", "expected swapped:STATION,STATION, found 'swapped'", "such as swapped:3,7"),
        ("scaled:1:2", "found 'scaled:1:2'", "such as scaled:1.25"),
        ("swapped:3", "expected two different stations, found '3'", "such as swapped:3,7"),
        ("swapped:3,03", "expected two different stations, found '3,03'", "such as swapped:3,7"),
        ("swapped:1,2,3", "found '1,2,3'", "such as swapped:3,7"),
        ("moved-plate:1,2:5mm", "expected one station, found '1,2'", "moved-plate:5:20mm"),
        ("moved-plate:1:5", "expected a number with one of the units", "moved-plate:5:20mm"),
        ("moved-plate:1:5ms", "found '5ms'", "moved-plate:5:20mm"),
        ("dropped:1,,2", "found '1,,2'", "such as dropped:2,5"),
        ("time-offset:40", "found '40'", "such as time-offset:40ms"),
        ("scaled:0", "expected a factor above 0, found '0'", "such as scaled:1.25"),
        ("scaled:twice", "found 'twice'", "such as scaled:1.25"),
        ("robot-scale:inf", "found 'inf'", "such as robot-scale:1.003"),
        ("robot-scale:nan", "found 'nan'", "such as robot-scale:1.003"),
        ("bowed:-infmm", "found '-infmm'", "such as bowed:1.2mm"),
    ],
)
def test_what_is_no_fault_says_what_was_expected(text, found, hint):
    with pytest.raises(UsageError) as caught:
        parse(text)
    assert found in caught.value.message
    assert hint in caught.value.hint
    assert caught.value.where.startswith("--fault")


def test_a_station_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(UsageError, match=r"00, 01, 02, 03, 04, found '9'"):
        staged("dropped:9")
    with pytest.raises(UsageError, match="did you mean 'left'"):
        stage(["left", "right"], [parse("moved-plate:lft:1mm")])
