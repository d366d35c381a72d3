"""The spread of motions on constructed motions: one axis, two axes, none, noise."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import se3
from handeye_cli.geometry.observability import motion_spread, nearest_axis

TILTED = np.array([1.0, 2.0, -2.0]) / 3.0
ACROSS = np.array([2.0, 1.0, 2.0]) / 3.0
X = se3.from_parts(Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix(), np.array([0.1, 0.2, 0.3]))


def motions(turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motions of the mount by rotation vectors, and the camera's that go with them."""
    R = Rotation.from_rotvec(turns).as_matrix()
    t = np.random.default_rng(1).normal(size=(len(turns), 3))
    motion_g = se3.from_parts(R, t)
    return motion_g, np.linalg.inv(X) @ motion_g @ X


def test_turning_about_one_axis_only():
    motion_g, motion_c = motions(np.array([[0.2], [-0.9], [0.5], [0.4]]) * TILTED)
    spread = motion_spread(motion_g, motion_c)
    assert spread.second_axis == pytest.approx(0.0, abs=1e-15)
    assert spread.largest_angle == pytest.approx(0.9, abs=1e-14)
    assert abs(spread.main_axis @ TILTED) == pytest.approx(1.0, abs=1e-14)
    assert np.linalg.norm(spread.main_axis) == pytest.approx(1.0, abs=1e-14)


def test_turning_about_two_perpendicular_axes():
    main, second = np.array([1.0, 0.8, -0.6]), np.array([0.3, -0.4])
    turns = np.concatenate([main[:, None] * TILTED, second[:, None] * ACROSS])
    spread = motion_spread(*motions(turns))
    # The axes of eq. (9) have the length 2 sin(angle / 2); the RMS is taken over all motions.
    expected = np.sqrt(np.sum((2.0 * np.sin(second / 2.0)) ** 2) / 5)
    assert spread.second_axis == pytest.approx(expected, rel=1e-12)
    assert spread.largest_angle == pytest.approx(1.0, abs=1e-14)
    assert abs(spread.main_axis @ TILTED) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("opening_deg", [0.1, 5.0, 60.0])
def test_two_axes_that_enclose_an_angle(opening_deg):
    opening = np.radians(opening_deg)
    other = np.cos(opening) * TILTED + np.sin(opening) * ACROSS
    spread = motion_spread(*motions(0.7 * np.array([TILTED, other])))
    # Two vectors of length p have the singular values p sqrt(1 +- cos(opening)).
    expected = 2.0 * np.sin(0.35) * np.sqrt((1.0 - np.cos(opening)) / 2.0)
    assert spread.second_axis == pytest.approx(expected, rel=1e-9)


def test_the_robot_that_stands_still():
    spread = motion_spread(*motions(np.zeros((4, 3))))
    assert spread.largest_angle == pytest.approx(0.0, abs=1e-14)
    assert spread.second_axis == pytest.approx(0.0, abs=1e-14)


def test_consistent_motions_have_no_mismatch_but_a_floor():
    turns = np.random.default_rng(2).normal(size=(6, 3))
    spread = motion_spread(*motions(turns))
    assert spread.mismatch == 1e-9
    assert spread.median_mismatch == pytest.approx(0.0, abs=1e-13)


def test_the_mismatch_is_the_noise_of_the_angles():
    rng = np.random.default_rng(3)
    turns = rng.uniform([0, -1, -1], [2, 1, 1], (4000, 3))
    motion_g, motion_c = motions(turns)
    sigma = 1e-3
    noisy = se3.perturb(motion_c, sigma * rng.normal(size=(4000, 6)))
    spread = motion_spread(motion_g, noisy)
    # Of a small turn only the component along the axis changes the angle: one sigma, normal.
    assert spread.mismatch == pytest.approx(sigma, rel=4 / np.sqrt(2 * 4000))
    assert spread.median_mismatch == pytest.approx(0.6745 * sigma, rel=0.08)


def test_one_bad_motion_moves_the_mean_but_not_the_median():
    motion_g, motion_c = motions(np.random.default_rng(4).uniform(-1, 1, (9, 3)))
    motion_c[3] = se3.from_parts(Rotation.from_rotvec([3.0, 0, 0]).as_matrix(), np.zeros(3))
    spread = motion_spread(motion_g, motion_c)
    assert spread.mismatch > 0.2
    assert spread.median_mismatch < 1e-12


def test_noise_alone_gives_no_more_of_a_second_axis_than_its_size():
    rng = np.random.default_rng(5)
    motion_g, motion_c = motions(rng.uniform(-1, 1, (200, 1)) * TILTED)
    sigma = 1e-3
    spread = motion_spread(se3.perturb(motion_g, sigma * rng.normal(size=(200, 6))), motion_c)
    assert spread.second_axis == pytest.approx(0.0, abs=1e-14)
    both = motion_spread(
        se3.perturb(motion_g, sigma * rng.normal(size=(200, 6))),
        se3.perturb(motion_c, sigma * rng.normal(size=(200, 6))),
    )
    # The larger of two directions across, each with a deviation of sigma / sqrt(2 * 200).
    assert 0.85 * sigma < both.second_axis < 1.25 * sigma


def test_the_weaker_of_the_two_sides_counts():
    wide, _ = motions(np.array([[0.5, 0, 0], [0, 0.9, 0]]))
    narrow, _ = motions(np.array([[0.5, 0, 0], [0.4, 0, 0]]))
    for spread in (motion_spread(wide, narrow), motion_spread(narrow, wide)):
        assert spread.largest_angle == pytest.approx(0.5, abs=1e-14)
        assert spread.second_axis == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", ["x", "y", "z"])
@pytest.mark.parametrize(("off_deg", "near"), [(0.0, True), (9.9, True), (10.1, False)])
def test_nearest_axis_within_ten_degrees(name, sign, off_deg, near):
    axis = np.eye(3)["xyz".index(name)]
    off = np.radians(off_deg)
    sideways = np.roll(axis, 1)
    direction = sign * (np.cos(off) * axis + np.sin(off) * sideways)
    assert nearest_axis(direction) == (name if near else None)


def test_a_diagonal_is_near_no_axis():
    assert nearest_axis(np.full(3, 3**-0.5)) is None
