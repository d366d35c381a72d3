"""Stations moved to the nearest allowed place, and the limit that binds where there is none."""

import numpy as np
import pytest
from planning.rigs import AIM, DISTANCE, FRAMES, TILT, cell, circle

from handeye_cli.errors import UndeterminedError
from handeye_cli.planning import views
from handeye_cli.planning.settle import apart, broken_limits, settle

NAMES = [f"{i:02d}" for i in range(20)]
GRID = views.grid(1.3 * TILT, np.pi, 0.7 * DISTANCE, 1.5 * DISTANCE)
WIDE = (DISTANCE / 4, 4 * DISTANCE)


def metric(at, wanted):
    turn, shift = apart(views.cameras_of(at, AIM), views.cameras_of(wanted, AIM))
    return turn + shift / DISTANCE


def test_stations_that_break_nothing_stay_to_the_last_bit():
    asked = circle(7)
    settled = settle(cell(distance=WIDE, depth=(0.05, 0.5)), asked, GRID, NAMES)
    np.testing.assert_array_equal(settled.views, asked)
    assert settled.broken == ((),) * 7


@pytest.mark.parametrize(
    "limits",
    [
        {"max_tilt": np.radians(20.0)},
        {"depth": (0.17, 0.3)},
        {"margin": 160.0},
        {"box": np.array([[0.45, -0.05, -1.0], [0.9, 0.4, 1.0]])},
        {"cone": np.array([0.0, 0.0, -1.0, np.radians(25.0)])},
        {"avoid_axis": (0, np.radians(12.0))},
        {"min_rotation": np.radians(55.0)},
    ],
    ids=lambda limits: next(iter(limits)),
)
def test_all_stations_are_allowed_afterwards_and_only_broken_ones_move(limits):
    where, asked = cell(distance=WIDE, sees="margin" in limits, **limits), circle(3)
    before = broken_limits(where, asked)
    assert any(before)
    settled = settle(where, asked, GRID, NAMES)
    assert broken_limits(where, settled.views) == ((),) * 3
    for old, new, broken, blamed in zip(asked, settled.views, before, settled.broken, strict=True):
        assert np.array_equal(old, new) == (blamed == ())
        assert blamed in ((), broken)


@pytest.mark.parametrize(
    "limits",
    [
        {"max_tilt": np.radians(15.0)},
        {"box": np.array([[0.4, -0.3, 0.25], [0.7, 0.3, 0.6]]), "margin": 30.0},
    ],
    ids=["tilt", "box"],
)
def test_no_place_of_thousands_tried_at_random_is_nearer(limits):
    rng = np.random.default_rng(8)
    where, asked = cell(distance=WIDE, **limits), circle(3)
    settled = settle(where, asked, GRID, NAMES)
    spread = np.array([0.35, 0.35, 0.3, 0.3 * DISTANCE, 0.15, 0.15])
    for wanted, found, broken in zip(asked, settled.views, settled.broken, strict=True):
        if not broken:
            continue
        tried = wanted + spread * rng.uniform(-1.0, 1.0, (20_000, 6))
        places = where.places(tried)
        allowed = np.all(where.excess(places, np.zeros((0, 3, 3))) == 0.0, axis=1)
        assert np.count_nonzero(allowed) > 100
        nearest = metric(tried[allowed], wanted[None]).min()
        assert metric(found[None], wanted[None])[0] <= nearest + 1e-3


def test_a_tilt_that_is_too_large_costs_the_difference():
    where = cell(distance=WIDE, sees=False, max_tilt=np.radians(20.0))
    settled = settle(where, circle(3), GRID, NAMES)
    assert views.tilts(settled.views) == pytest.approx(np.radians(20.0), abs=1e-3)
    assert settled.broken == (("max-tilt",),) * 3


@pytest.mark.parametrize(
    ("limits", "message", "hint"),
    [
        (
            {"box": np.array([[5.0, 5.0, 5.0], [6.0, 6.0, 6.0]])},
            r"station \d\d: no place keeps the limit box; the nearest misses it by [78]\d{3} mm",
            "widen --box",
        ),
        (
            {"margin": 300.0},
            r"no place keeps the limit view; the nearest misses it by 6\d",
            "--marg",
        ),
        (
            {"max_tilt": 0.05, "min_rotation": np.radians(40.0), "max_roll": 0.05},
            r"station 01: no place that keeps the other limits keeps min-rotation as well; .* 3\d",
            "--min-rotation",
        ),
        (
            {"depth": (0.02, 0.03), "max_tilt": 0.1},
            r"station 00: no place keeps the limit depth; the nearest misses it by 3\d\.\d mm",
            "--depth",
        ),
    ],
    ids=["box", "view", "min-rotation", "depth"],
)
def test_the_limit_that_binds_is_named(limits, message, hint):
    with pytest.raises(UndeterminedError, match=message) as caught:
        settle(cell(distance=WIDE, **limits), circle(4), GRID, NAMES)
    assert hint in caught.value.hint


def test_travel_along_an_axis_is_kept_out_by_a_narrow_box():
    # the trouble of the paper's own robot: its x axis was not to be moved
    middle = FRAMES.grippers(views.cameras_of(circle(4), AIM))[:, 0, 3].mean()
    box = np.array([[middle - 0.02, -9.0, -9.0], [middle + 0.02, 9.0, 9.0]])
    settled = settle(cell(distance=WIDE, sees=False, box=box), circle(4), GRID, NAMES)
    robot = FRAMES.grippers(views.cameras_of(settled.views, AIM))
    assert np.ptp(robot[:, 0, 3]) <= 0.04 + 1e-12
