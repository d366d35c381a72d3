"""Poses of the plate, their covariances, and the choice between the two that a plane allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pictures import CAMERA, shoot

from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera, Noise, Observation

FAR = Camera(640, 480, 20000.0, 20000.0, 319.5, 239.5)
"""A long lens: the plate's two poses fit about as well."""


def poses_of(stations):
    return np.array([station.camera_T_target.matrix for station in stations.stations])


@pytest.mark.many_runs
@pytest.mark.parametrize("setup", Setup)
def test_errors_follow_the_covariance(setup):
    rng = np.random.default_rng(3)
    squares = []
    for _ in range(10):
        shot = shoot(rng, 10, setup=setup)
        found = extrinsics(shot.features)
        error = se3.difference(poses_of(found), shot.camera_T_target)
        for row, station in zip(error, found.stations, strict=True):
            squares.append(row @ np.linalg.solve(station.camera_T_target.covariance, row))
    # chi-square with 6 degrees of freedom over 100 stations: 6 +- 3 * sqrt(12 / 100)
    assert np.mean(squares) == pytest.approx(6.0, abs=1.1)


def test_given_pixel_noise_is_taken():
    shot = shoot(np.random.default_rng(5), 6)
    one = extrinsics(replace(shot.features, noise=Noise(pixel=0.1)))
    two = extrinsics(replace(shot.features, noise=Noise(pixel=0.2)))
    for a, b in zip(one.stations, two.stations, strict=True):
        np.testing.assert_allclose(
            4 * a.camera_T_target.covariance, b.camera_T_target.covariance, rtol=1e-12
        )


@pytest.mark.parametrize("setup", Setup)
def test_the_planar_ambiguity_is_decided_over_all_stations(setup):
    """Weak perspective: image by image, many poses come out mirrored; together none does."""
    rng = np.random.default_rng(7)
    alone = together = 0
    for _ in range(5):
        shot = shoot(rng, 9, camera=FAR, distance=3.3, tilt_deg=12, sigma_px=0.2, setup=setup)
        still = replace(
            shot.features,
            stations=tuple(replace(s, base_T_gripper=np.eye(4)) for s in shot.features.stations),
        )
        for features in (shot.features, still):
            turn = poses_of(extrinsics(features))[:, :3, :3]
            off = rotations.angle(np.swapaxes(turn, -1, -2) @ shot.camera_T_target[:, :3, :3])
            wrong = int(np.sum(off > np.radians(12)))
            together += wrong if features is shot.features else 0
            alone += wrong if features is still else 0
    assert together == 0
    assert alone >= 3


def test_a_wrong_detection_is_named_and_does_not_spoil_the_pooled_noise():
    rng = np.random.default_rng(11)
    shot = shoot(rng, 8)
    rows = list(shot.features.stations)
    seen = rows[2].observation
    pixels = seen.pixels + rng.normal(size=seen.pixels.shape) * 20
    rows[2] = replace(rows[2], observation=replace(seen, pixels=pixels))
    found = extrinsics(replace(shot.features, stations=tuple(rows)))
    assert found.stations[2].camera_T_target is None
    assert "reprojection error" in found.stations[2].reason
    depth = np.sqrt(found.stations[0].camera_T_target.covariance[2, 2])
    clean = extrinsics(shot.features).stations[0].camera_T_target.covariance[2, 2]
    assert depth == pytest.approx(np.sqrt(clean), rel=0.2)


def test_unusable_stations_keep_a_reason():
    shot = shoot(np.random.default_rng(13), 6)
    rows = list(shot.features.stations)
    rows[0] = replace(rows[0], observation=None, reason="31 of 36 discs were found")
    seen = rows[1].observation
    rows[1] = replace(rows[1], observation=Observation(seen.ids[:3], seen.pixels[:3]))
    found = extrinsics(replace(shot.features, stations=tuple(rows)))
    assert found.stations[0].reason == "31 of 36 discs were found"
    assert found.stations[1].reason == "3 points were seen, at least 4 are needed"
    assert [s.camera_T_target is None for s in found.stations] == [True, True] + 4 * [False]
    assert found.stations[1].observation is not None


def test_nothing_seen_at_all_is_an_error():
    shot = shoot(np.random.default_rng(17), 4)
    rows = tuple(replace(s, observation=None, reason="blurred") for s in shot.features.stations)
    with pytest.raises(UndeterminedError, match="found it in none of 4"):
        extrinsics(replace(shot.features, stations=rows))


def test_calibrating_replaces_wrong_intrinsics_and_says_so():
    rng = np.random.default_rng(19)
    shot = shoot(rng, 12, sigma_px=0.02)
    wrong = replace(CAMERA, fx=1600.0, fy=1600.0, distortion=())
    found = extrinsics(replace(shot.features, camera=wrong), calibrate_intrinsics=True)
    assert abs(found.camera.fx - CAMERA.fx) < 5 * np.sqrt(found.camera.covariance[0, 0])
    assert [finding.code for finding in found.findings] == ["intrinsics-calibrated"]
    kept = extrinsics(replace(shot.features, camera=wrong))
    assert kept.camera is wrong


def test_given_intrinsics_that_contradict_the_views_are_doubted():
    rng = np.random.default_rng(23)
    shot = shoot(rng, 9, sigma_px=0.02)
    assert extrinsics(shot.features).findings == ()
    bent = replace(CAMERA, distortion=(0.3, 0.0, 0.0, 0.0, 0.0))
    (finding,) = extrinsics(replace(shot.features, camera=bent)).findings
    assert finding.code == "intrinsics-doubtful"
    assert "calibrated from the same images 0.02 px" in finding.message
    assert "--calibrate-intrinsics" in finding.advice


def test_views_that_may_all_be_mirrored_are_reported():
    rng = np.random.default_rng(29)
    longest = replace(FAR, fx=45000.0, fy=45000.0)
    shot = shoot(rng, 9, camera=longest, distance=7.5, tilt_deg=12, sigma_px=0.3)
    findings = {finding.code: finding for finding in extrinsics(shot.features).findings}
    assert "mirroring all stations" in findings["planar-ambiguity"].message
    near = extrinsics(shoot(rng, 9).features).findings
    assert near == ()


@pytest.mark.parametrize(
    "wrong", [{"distortion": (-9.0,)}, {"cx": 1e9}, {"fx": 1e-3}, {"fx": 1e9, "fy": 1e9}]
)
def test_absurd_intrinsics_are_no_crash(wrong):
    """Either no pose explains the points, or the poses come with a doubt; never a warning."""
    shot = shoot(np.random.default_rng(31), 8)
    features = replace(shot.features, camera=replace(CAMERA, **wrong))
    try:
        findings = extrinsics(features).findings
    except UndeterminedError:
        with pytest.raises(UndeterminedError, match="explains the points of any of 8 images"):
            extrinsics(features)
    else:
        assert findings
