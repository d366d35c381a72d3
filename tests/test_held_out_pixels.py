"""Errors in the image and on the plate, for a camera whose error is known."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import camera as lens
from handeye_cli.geometry import se3
from handeye_cli.held_out_pixels import pixel_errors
from handeye_cli.records import Camera, Observation, Station, Stations, TargetSpec, UncertainPose

BOARD = TargetSpec("chessboard", {"columns": 9, "rows": 6, "square_mm": 20.0})
CAMERA = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, (-0.2, 0.05, 1e-3, -1e-3))
FACING = se3.from_parts(np.eye(3), np.array([-0.08, -0.05, 0.5]))


def document(*stations, target=BOARD):
    return Stations(Setup.EYE_IN_HAND, stations, target=target, camera=CAMERA)


def seen(pose, ids, shift=(0.0, 0.0)):
    points = targets.build(BOARD).points()[ids]
    pixels = lens.project(se3.transform_points(pose, points), CAMERA.parameters)
    observation = Observation(np.array(ids), pixels + shift)
    return Station("00", np.eye(4), observation, UncertainPose(pose))


def test_a_true_camera_has_none():
    found = pixel_errors(document(seen(FACING, range(54))), np.array([0]), FACING[None], CAMERA)
    assert found.reprojection[0] < 1e-9
    assert found.plate[0] < 1e-12


def test_a_camera_beside_its_place_touches_the_plate_beside_the_point():
    expected = se3.perturb(FACING, np.array([3e-4, 4e-4, 0, 0, 0, 0]))
    station = seen(FACING, range(10, 30))
    found = pixel_errors(document(station), np.array([0]), expected[None], CAMERA)
    assert found.plate[0] == pytest.approx(5e-4, rel=1e-9)
    # 500 px focal length at 0.5 m, but for the distortion
    assert found.reprojection[0] == pytest.approx(0.5, rel=0.05)


def test_pixels_that_are_off_are_an_error_in_the_image_and_on_the_plate():
    station = seen(FACING, range(54), shift=(0.3, -0.4))
    found = pixel_errors(document(station), np.array([0]), FACING[None], CAMERA)
    assert found.reprojection[0] == pytest.approx(0.5, rel=1e-9)
    assert found.plate[0] == pytest.approx(5e-4, rel=0.05)


def test_what_cannot_be_told_is_not_a_number():
    behind = se3.from_parts(np.eye(3), np.array([0, 0, -0.5]))
    blind = Station("01", np.eye(4), camera_T_target=UncertainPose(FACING))
    stations = document(seen(FACING, range(54)), blind, seen(FACING, range(54)))
    poses = np.array([behind, FACING, FACING])
    found = pixel_errors(stations, np.arange(3), poses, CAMERA)
    np.testing.assert_array_equal(np.isnan(found.reprojection), [True, True, False])
    np.testing.assert_array_equal(np.isnan(found.plate), [True, True, False])
    for nothing in (
        pixel_errors(stations, np.arange(3), poses, None),
        pixel_errors(document(blind), np.array([0]), FACING[None], CAMERA),
        pixel_errors(document(*stations.stations, target=None), np.arange(3), poses, CAMERA),
    ):
        assert np.all(np.isnan(nothing.reprojection))
        assert np.all(np.isnan(nothing.plate))
