"""Noise taken as given, estimated, or put down to the robot where nothing tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.geometry.star import star_pairs
from handeye_cli.noise_levels import noise_model
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, tsai_lenz

NOISE = Noise(2e-3, 3e-4, 1e-3, 2e-4)


def model_of(document, given=None):
    chain = chain_of(document)
    count = len(chain.A)
    solution = tsai_lenz.solve(Problem(chain.A, chain.B, star_pairs(count), np.eye(12)))
    return noise_model(chain, given, solution)


@pytest.mark.many_runs
@pytest.mark.parametrize("setup", Setup)
def test_the_robots_levels_are_found_without_bias(setup):
    rng = np.random.default_rng(3)
    squares = []
    for _ in range(60):
        noise = model_of(stations(rng, general_scene(rng, 15), NOISE, setup=setup)).noise
        squares.append([noise.robot_rotation**2, noise.robot_translation**2])
        assert noise.camera_rotation == pytest.approx(1e-3, rel=1e-6)
        assert noise.camera_translation == pytest.approx(2e-4, rel=1e-6)
    mean, error = np.mean(squares, axis=0), np.std(squares, axis=0) / np.sqrt(60)
    assert np.all(np.abs(mean - [4e-6, 9e-8]) < 3 * error)


def test_given_levels_are_taken():
    rng = np.random.default_rng(5)
    model = model_of(stations(rng, general_scene(rng, 8), NOISE), NOISE)
    assert model.noise == NOISE
    assert len(model.shapes) == 0
    expected = np.repeat([3e-8, 4e-6 / 3, 4e-8 / 3, 1e-6 / 3], 3)
    np.testing.assert_allclose(np.diagonal(model.covariance, axis1=1, axis2=2)[0], expected)


def test_one_given_level_leaves_the_other_to_be_estimated():
    rng = np.random.default_rng(7)
    document = stations(rng, general_scene(rng, 40), NOISE)
    model = model_of(document, Noise(robot_rotation=2e-3))
    assert model.noise.robot_rotation == 2e-3
    assert len(model.shapes) == 1
    assert model.noise.robot_translation == pytest.approx(3e-4, rel=0.4)


@pytest.mark.parametrize(
    ("name", "level"), [("camera_rotation", 5e-3), ("camera_translation", 1e-3)]
)
def test_one_given_level_of_the_camera_leaves_the_other_half_its_covariance(name, level):
    rng = np.random.default_rng(9)
    document = stations(rng, general_scene(rng, 8), NOISE)
    model = model_of(document, Noise(2e-3, 3e-4, **{name: level}))
    both = replace(NOISE, **{name: level})
    assert model.noise.camera_rotation == pytest.approx(both.camera_rotation)
    assert model.noise.camera_translation == pytest.approx(both.camera_translation)
    expected = model_of(document, both).covariance
    np.testing.assert_allclose(model.covariance, expected, atol=1e-20)


def test_the_camera_is_estimated_where_only_the_robot_is_known():
    rng = np.random.default_rng(11)
    document = stations(rng, general_scene(rng, 60), NOISE, with_covariance=False)
    model = model_of(document, Noise(robot_rotation=2e-3, robot_translation=3e-4))
    assert model.noise.camera_rotation == pytest.approx(1e-3, rel=0.35)
    assert np.all(model.shapes[:, :, :6] == 0)


def test_without_any_knowledge_all_is_put_down_to_the_robot():
    rng = np.random.default_rng(13)
    document = stations(rng, general_scene(rng, 40), NOISE, with_covariance=False)
    noise = model_of(document).noise
    assert noise.camera_rotation is None
    assert noise.robot_rotation == pytest.approx(np.hypot(2e-3, 1e-3), rel=0.25)
