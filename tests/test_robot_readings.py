"""Poses of a plate that looks the same after a turn are chosen whatever convention the robot's
rotations are written in."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli import robot_readings
from handeye_cli.geometry import consensus

QUARTERS = Rotation.from_rotvec(np.pi / 2 * np.arange(4)[:, None] * [0, 0, 1]).as_matrix()


def rolled(R):
    return Rotation.from_quat(np.roll(Rotation.from_matrix(R).as_quat(), 1, axis=-1)).as_matrix()


READINGS = {
    "as-declared": lambda R: R,
    "inverted": lambda R: np.swapaxes(R, -1, -2),
    "other-quaternion-order": rolled,
    "both": lambda R: np.swapaxes(rolled(R), -1, -2),
}


@pytest.fixture
def plate():
    """Rotations of a robot, and each station's rotation of the plate with its turns shuffled."""
    rng = np.random.default_rng(4)
    robot = Rotation.from_rotvec(0.4 * rng.normal(size=(12, 3)) + [2.5, 0.3, 0.0]).as_matrix()
    X, Z = Rotation.random(2, random_state=5).as_matrix()
    noise = Rotation.from_rotvec(1e-3 * rng.normal(size=(12, 3))).as_matrix()
    seen = noise @ np.swapaxes(robot @ X, -1, -2) @ Z
    turns = rng.integers(0, 4, size=12)
    candidates = seen[:, None] @ QUARTERS[(np.arange(4) - turns[:, None]) % 4]
    return robot, candidates, turns


@pytest.mark.parametrize("reading", READINGS)
def test_all_stations_get_the_same_turn(plate, reading):
    robot, candidates, turns = plate
    choice = robot_readings.choose(READINGS[reading](robot), candidates, np.zeros((12, 4)))
    assert len(set(((choice.index - turns) % 4).tolist())) == 1
    assert choice.misfit < 0.01


def test_the_declared_reading_alone_would_scramble_them(plate):
    robot, candidates, turns = plate
    choice = consensus.choose(READINGS["inverted"](robot), candidates, np.zeros((12, 4)))
    assert len(set(((choice.index - turns) % 4).tolist())) > 1
    assert choice.misfit > 0.04
