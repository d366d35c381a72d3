"""Residuals over image and plate: known displacements come back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pictures import CAMERA, grid, shoot
from reporting.cases import stations

from handeye_cli.errors import InputError
from handeye_cli.geometry import camera as lens
from handeye_cli.geometry import se3
from handeye_cli.records import Observation, UncertainPose
from handeye_cli.reporting.pixel_residuals import pixel_residuals

POINTS = grid(6, 6, 0.005)


def seen(moved=0.0, shift=0.0):
    """Stations that saw each point moved on the plate and shifted in the image, without noise."""
    shot = shoot(np.random.default_rng(5), 6, sigma_px=0.0)
    rows = []
    for station, pose in zip(shot.features.stations, shot.camera_T_target, strict=True):
        here = se3.transform_points(pose, POINTS + moved)
        pixels = lens.project(here, CAMERA.parameters, CAMERA.model) + shift
        rows.append(
            replace(
                station,
                observation=Observation(np.arange(36), pixels),
                camera_T_target=UncertainPose(pose),
            )
        )
    return replace(
        stations(), stations=tuple(rows), camera=shot.features.camera, target=shot.features.target
    )


def test_perfect_points_have_no_residuals():
    found = pixel_residuals(seen())
    assert found.rms < 1e-9
    assert found.size == (640, 480)
    assert len(found.pixels) == 6 * 36


def test_a_shift_in_the_image_comes_back_in_every_cell():
    found = pixel_residuals(seen(shift=np.array([0.3, -0.1])))
    np.testing.assert_allclose(found.image.means, np.tile([0.3, -0.1], (len(found.image.means), 1)))
    assert found.image.counts.sum() == 6 * 36
    assert found.rms == pytest.approx(np.sqrt((0.3**2 + 0.1**2) / 2))


def test_points_that_are_misplaced_on_the_plate_come_back_on_the_plate():
    rng = np.random.default_rng(8)
    moved = np.concatenate([2e-5 * rng.normal(size=(36, 2)), np.zeros((36, 1))], axis=1)
    found = pixel_residuals(seen(moved=moved))
    np.testing.assert_allclose(found.plate.places, POINTS[:, :2])
    # to first order; the second is the square over the distance of 0.15 m
    np.testing.assert_allclose(found.plate.means, moved[:, :2], atol=3e-8)


def test_cells_hold_their_own_points():
    found = pixel_residuals(seen())
    side = 640 / 16
    cells = np.floor((found.image.places + 0.5) / side)
    assert len(np.unique(cells, axis=0)) == len(cells)


def test_plates_behind_the_camera_leave_no_residuals():
    whole, mirror = seen(), np.diag([1.0, 1.0, -1.0])
    rows = []
    for station in whole.stations:
        pose = station.camera_T_target.matrix.copy()
        pose[:3] = mirror @ pose[:3]
        rows.append(replace(station, camera_T_target=UncertainPose(pose)))
    assert pixel_residuals(replace(whole, stations=tuple(rows))) is None
    some = replace(whole, stations=(*rows[:2], *whole.stations[2:]))
    assert len(pixel_residuals(some).pixels) == 4 * 36


def test_a_point_the_target_has_not_is_refused():
    whole = seen()
    strange = replace(whole.stations[3], observation=Observation(np.arange(37), np.zeros((37, 2))))
    rows = (*whole.stations[:3], strange, *whole.stations[4:])
    with pytest.raises(InputError, match="found 36") as caught:
        pixel_residuals(replace(whole, stations=rows))
    assert caught.value.where == 'station "03"'


@pytest.mark.parametrize("missing", [{"camera": None}, {"target": None}])
def test_without_intrinsics_or_target_there_is_nothing(missing):
    assert pixel_residuals(replace(seen(), **missing)) is None
