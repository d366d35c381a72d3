"""The verdict on robot poses and images that want different intrinsics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pictures import WIDE

from handeye_cli import intrinsics_check
from handeye_cli.geometry.joint_bundle import LinearLoops
from handeye_cli.intrinsics_check import check_intrinsics

NOTHING = np.zeros((0, 6))
AFTER = replace(WIDE, fx=WIDE.fx + 7.0)


def verdict(images, robot, apart, freedom=math.inf):
    """Of images and robot that each see the intrinsics with an information, so far apart."""
    both = np.linalg.inv(images + robot)
    gradient = images @ both @ robot @ apart
    linear = LinearLoops(NOTHING, NOTHING, NOTHING, NOTHING, NOTHING, images, gradient)
    return check_intrinsics(linear, both, freedom, WIDE, AFTER)


def random_information(rng, strength):
    root = rng.normal(size=(5, 5))
    return strength * root @ root.T + 1e-6 * np.eye(5)


@pytest.mark.parametrize("strength", [0.01, 1.0, 100.0])
def test_chance_alone_is_blamed_as_often_as_intended(strength, monkeypatch):
    monkeypatch.setattr(intrinsics_check, "_SIGNIFICANCE", 0.05)
    rng = np.random.default_rng(3)
    blamed = 0
    for _ in range(2000):
        images, robot = random_information(rng, 1.0), random_information(rng, strength)
        spread = np.linalg.inv(images) + np.linalg.inv(robot)
        apart = np.linalg.cholesky(spread) @ rng.normal(size=5)
        blamed += verdict(images, robot, apart) is not None
    # Two moments of the distribution are matched, not all of it.
    assert 0.03 < blamed / 2000 < 0.07


def test_a_contradiction_is_told_with_its_numbers():
    finding = verdict(np.eye(5), np.eye(5), np.array([10.0, 0.0, 0.0, 0.0, 0.0]))
    assert finding.code == "intrinsics-contradicted"
    assert finding.severity == "warning"
    assert "900.0 px by the images, 907.0 px by both" in finding.message
    assert "chi-square 25.0 where 2.5 is expected" in finding.message


def test_few_degrees_of_freedom_ask_for_more():
    apart = np.array([8.0, 0.0, 0.0, 0.0, 0.0])
    assert verdict(np.eye(5), np.eye(5), apart) is not None
    assert verdict(np.eye(5), np.eye(5), apart, freedom=3.0) is None


def test_a_robot_that_says_nothing_contradicts_nothing():
    assert verdict(np.eye(5), 1e-9 * np.eye(5), np.full(5, 1e3)) is None
