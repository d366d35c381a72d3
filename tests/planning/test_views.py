"""Places of the camera as six numbers."""

import numpy as np
import pytest
from planning.rigs import AIM

from handeye_cli.geometry import rotations
from handeye_cli.geometry.station_generator import tilted_stations
from handeye_cli.planning import views


def test_views_of_the_circle_are_the_papers_stations_to_the_last_bit():
    angles = np.linspace(0.0, 6.0, 13)
    seen = views.cameras_of(views.circle_views(angles, 0.17, 0.5), AIM)
    np.testing.assert_array_equal(seen, tilted_stations(angles, 0.17, 0.5, AIM))


def test_the_numbers_mean_what_they_say():
    rng = np.random.default_rng(1)
    at = rng.uniform(-0.5, 0.5, (50, 6))
    at[:, views.DISTANCE] = rng.uniform(0.1, 0.4, 50)
    cameras = views.cameras_of(at, AIM)
    away = cameras[:, :3, 3] - AIM
    assert np.linalg.norm(away, axis=1) == pytest.approx(at[:, views.DISTANCE])
    normal_angle = np.arccos(-away[:, 2] / np.linalg.norm(away, axis=1))
    assert views.tilts(at) == pytest.approx(normal_angle, abs=1e-7)
    axis_off = np.arccos(np.sum(cameras[:, :3, 2] * -away, axis=1) / at[:, views.DISTANCE])
    assert np.hypot(at[:, 4], at[:, 5]) == pytest.approx(axis_off, abs=1e-7)
    still = at.copy()
    still[:, views.ROLL] = still[:, 4] = still[:, 5] = 0.0
    rolled = still.copy()
    rolled[:, views.ROLL] = at[:, views.ROLL]
    turn = np.swapaxes(views.cameras_of(still, AIM), -1, -2) @ views.cameras_of(rolled, AIM)
    about_axis = np.outer(at[:, views.ROLL], [0.0, 0.0, 1.0])
    assert rotations.log(turn[:, :3, :3]) == pytest.approx(about_axis, abs=1e-12)


def test_rolls_are_counted_either_way_round():
    at = np.zeros((4, 6))
    at[:, views.ROLL] = [0.3, -0.3, 2 * np.pi - 0.3, np.pi]
    assert views.rolls(at) == pytest.approx([0.3, 0.3, 0.3, np.pi])


@pytest.mark.parametrize("roll", [0.0, 0.6, np.pi])
def test_the_grid_keeps_its_limits_and_repeats_no_place(roll):
    grid = views.grid(0.5, roll, 0.1, 0.3)
    assert views.tilts(grid).max() == pytest.approx(0.5)
    assert views.rolls(grid).max() <= roll + 1e-12
    assert grid[:, views.DISTANCE].min() == pytest.approx(0.1)
    assert grid[:, views.DISTANCE].max() == pytest.approx(0.3)
    turned = np.exp(1j * grid[:, views.ROLL])
    keys = np.round(np.c_[grid[:, [0, 1, 3]], turned.real, turned.imag], 9) + 0.0
    assert len(np.unique(keys, axis=0)) == len(grid)
