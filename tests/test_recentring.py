"""Discs measured without intrinsics, and moved to where the calibrated ones put their centres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.extract import extract
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Noise
from handeye_cli.simulate.recording import Rig, simulate_recording
from handeye_cli.simulate.render import Appearance

SPEC = targets.parse("disc-grid:7x7:6mm:4mm:5.5mm")
LENS = Camera(640, 480, 620.0, 622.0, 322.0, 238.0, (-0.25, 0.08, 1e-3, -5e-4, 0.0))
COUNT = 7


@pytest.fixture(scope="module")
def scene():
    """A recording with strong distortion, and where the centres of the discs are in its images."""
    points = targets.build(SPEC).points()
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    rig = Rig(
        SPEC,
        LENS,
        se3.from_parts(np.eye(3), np.array([0.02, 0.0, 0.1])),
        np.eye(4),
        noise=Noise(5e-4, 5e-5),
        appearance=Appearance(noise=1.0),
    )
    simulated = simulate_recording(rig, generate_stations(COUNT, 0.068, np.radians(28), middle), 5)
    truth = [
        project(se3.transform_points(pose, points), LENS.parameters)
        for pose in simulated.camera_T_target
    ]
    return simulated.recording, truth


def rms(stations, truth):
    errors = [
        station.observation.pixels - pixels[station.observation.ids]
        for station, pixels in zip(stations, truth, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def test_without_intrinsics_the_centres_end_where_known_intrinsics_put_them(scene):
    recording, truth = scene
    known = extract(recording)
    unknown = extract(replace(recording, camera=None))
    assert rms(known.stations, truth) < 0.003
    # what the distortion within each disc does to its middle
    assert rms(unknown.stations, truth) > 5 * rms(known.stations, truth)
    found = extrinsics(unknown)
    assert rms(found.stations, truth) < 1.5 * rms(known.stations, truth)


def test_wrong_intrinsics_do_not_stay_in_the_centres(scene):
    """The same, where the recording's own intrinsics know nothing of the distortion."""
    recording, truth = scene
    blind = extract(replace(recording, camera=replace(LENS, distortion=())))
    found = extrinsics(blind, calibrate_intrinsics=True)
    assert rms(found.stations, truth) < 0.1 * rms(blind.stations, truth)
    assert found.camera.fx == pytest.approx(LENS.fx, abs=0.1)


def test_given_intrinsics_leave_the_points_alone(scene):
    recording, _ = scene
    features = extract(recording)
    stations = extrinsics(features).stations
    for before, after in zip(features.stations, stations, strict=True):
        np.testing.assert_array_equal(after.observation.pixels, before.observation.pixels)
