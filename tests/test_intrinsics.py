"""Intrinsics from the recording's own images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pictures import WIDE, grid, shoot

from handeye_cli.errors import InputError, UndeterminedError
from handeye_cli.intrinsics import calibrate_intrinsics, camera_or_calibrated
from handeye_cli.views import views_of

POINTS = grid(7, 9, 0.03)


def wide_shot(rng, camera=WIDE, *, count=12, **more):
    return shoot(rng, count, camera=camera, points=POINTS, distance=0.3, **more)


def calibrated(features):
    return calibrate_intrinsics(features, views_of(features.stations, POINTS))


@pytest.mark.many_runs
@pytest.mark.parametrize("known", [True, False])
def test_truth_lies_within_the_covariance(known):
    rng = np.random.default_rng(3)
    camera = replace(WIDE, distortion=(-0.25, 0.08, 5e-4, -5e-4))
    inside = []
    for _ in range(12):
        features = wide_shot(rng, camera).features
        found, finding = calibrated(features if known else replace(features, camera=None))
        if len(found.distortion) != 4:
            continue
        apart = found.parameters - camera.parameters
        inside.append(apart @ np.linalg.solve(found.covariance, apart))
        assert "focal length" in finding.message
    # chi-square with 8 degrees of freedom: mean 8, standard deviation 4
    assert len(inside) >= 10
    assert 8 - 3 * 4 / np.sqrt(len(inside)) < np.mean(inside) < 8 + 3 * 4 / np.sqrt(len(inside))


@pytest.mark.parametrize("distortion", [(), (-0.25,), (-0.25, 0.12), (-0.25, 0.12, 2e-3, -1e-3)])
def test_evidence_finds_the_number_of_coefficients(distortion):
    rng = np.random.default_rng(7)
    right = 0
    for _ in range(5):
        features = wide_shot(rng, replace(WIDE, distortion=distortion), sigma_px=0.02).features
        right += len(calibrated(features)[0].distortion) == len(distortion)
    assert right >= 4


def test_given_intrinsics_are_kept_unless_asked():
    rng = np.random.default_rng(11)
    features = wide_shot(rng).features
    assert camera_or_calibrated(features, views_of(features.stations, POINTS)) is WIDE


def test_neither_camera_nor_size_is_an_input_error():
    features = replace(wide_shot(np.random.default_rng(13)).features, camera=None, image_size=None)
    with pytest.raises(InputError, match="intrinsics or the size of its images"):
        calibrated(features)


def test_two_views_are_not_enough():
    features = wide_shot(np.random.default_rng(17)).features
    with pytest.raises(UndeterminedError, match=r"at least 3 views.*found 2"):
        calibrated(replace(features, stations=features.stations[:2]))


@pytest.mark.parametrize("known", [True, False])
def test_frontal_views_do_not_determine_a_focal_length(known):
    features = wide_shot(np.random.default_rng(19), count=5, tilt_deg=0.01).features
    with pytest.raises(UndeterminedError, match="do not determine"):
        calibrated(features if known else replace(features, camera=None))
