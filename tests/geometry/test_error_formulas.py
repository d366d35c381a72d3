"""Eq. (28)-(33) as the paper prints them (repaired), and against simulated calibrations."""

import itertools

import numpy as np
import pytest

from handeye_cli.conventions import MIL, MRAD, Setup
from handeye_cli.geometry import error_formulas, rotations, se3
from handeye_cli.geometry.error_formulas import FormulaFactors, StationNoise
from handeye_cli.geometry.error_radius import MAX_OVER_RMS
from handeye_cli.geometry.star import all_pairs, star_pairs
from handeye_cli.geometry.station_generator import generate_stations, robot_poses
from handeye_cli.solvers import Problem, tsai_lenz

INCH = 0.0254
NOISE = StationNoise(1.5 * MRAD, 5 * MIL, 1.5 * MRAD, 3 * MIL)
PAIR_ROTATION = 2.0 * (NOISE.robot_rotation**2 + NOISE.camera_rotation**2)
PAIR_ROTATION_MAX = 2.0 * MAX_OVER_RMS * (NOISE.robot_rotation + NOISE.camera_rotation)
TILT = np.radians(30.0)
CONSECUTIVE = np.array([[0, 1], [1, 2]])
"""The two motions that the paper's three-station formulas are written with."""

# |T_cg| = 9.5 in, and a turn far from the exceptions of eq. (12).
X = se3.from_parts(
    rotations.exp(np.array([0.4, -0.2, 0.9])), 9.5 * INCH * np.array([0.0, 0.0, -1.0])
)
Z = se3.from_parts(rotations.exp(np.array([0.1, 0.2, -0.7])), np.array([0.6, -0.2, 0.1]))


def stations(count: int, tilt: float = TILT) -> tuple[np.ndarray, np.ndarray]:
    """The paper's base layout: robot poses A and extrinsics B without noise."""
    cameras = generate_stations(count, 6.65 * INCH, tilt)
    return robot_poses(cameras, X, Z, Setup.EYE_IN_HAND), np.linalg.inv(cameras)


def motions(A: np.ndarray, B: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H_gij and H_cij of eq. (6) and (7)."""
    i, j = pairs.T
    return np.linalg.inv(A[j]) @ A[i], B[j] @ np.linalg.inv(B[i])


def factors(count: int, pairs: np.ndarray, tilt: float = TILT) -> FormulaFactors:
    A, B = stations(count, tilt)
    return error_formulas.critical_factors(A, B, motions(A, B, pairs)[1], pairs)


class Printed:
    """The quantities of the three-station formulas, each by the textbook's definition."""

    def __init__(self, tilt: float = TILT):
        A, B = stations(3, tilt)
        turns = motions(A, B, CONSECUTIVE)[0][:, :3, :3]
        self.theta = np.arccos((np.trace(turns, axis1=1, axis2=2) - 1.0) / 2.0)
        odd = turns - np.swapaxes(turns, 1, 2)
        axes = np.stack([odd[:, 2, 1], odd[:, 0, 2], odd[:, 1, 0]], axis=1)
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        self.sine = np.linalg.norm(np.cross(*axes))
        self.condition = np.linalg.cond((turns - np.eye(3)).reshape(-1, 3))
        self.T_c1 = np.linalg.norm(B[0, :3, 3])
        self.moves = np.linalg.norm(np.diff(A[:, :3, 3], axis=0), axis=1)

    def equation_28c(self) -> float:
        return np.sqrt(4.0 / 3.0 * PAIR_ROTATION) / (self.sine * self.theta[0])

    def equation_31(self) -> float:
        th12, th23 = self.theta
        turn = np.sqrt(2.0 * (np.sin(th12 / 2) ** 2 + np.sin(th23 / 2) ** 2))
        uneven = (th12**2 + th23**2) ** 2 / (th12 * th23) ** 2
        first = 4.0 / 9.0 * PAIR_ROTATION / self.sine**2 * self.T_c1**2 * uneven
        second = (
            8.0 / 3.0 * NOISE.camera_rotation**2 * self.T_c1**2
            + 4.0 * NOISE.camera_translation**2
            + 2.0 / 3.0 * NOISE.robot_rotation**2 * np.sum(self.moves**2)
            + 4.0 * NOISE.robot_translation**2
        )
        return np.sqrt(first + self.condition * second) / turn

    def equation_32(self) -> float:
        first = 16.0 / 9.0 * PAIR_ROTATION / self.sine**2 * self.T_c1**2
        second = (
            8.0 / 3.0 * NOISE.camera_rotation**2 * self.T_c1**2
            + 4.0 * NOISE.camera_translation**2
            + 4.0 / 3.0 * NOISE.robot_rotation**2 * self.moves[0] ** 2
            + 4.0 * NOISE.robot_translation**2
        )
        return np.sqrt(first + self.condition * second) / (2.0 * np.sin(self.theta[0] / 2.0))


def equation_29(count: int, tilt: float = TILT) -> float:
    _, motion_c = motions(*stations(count, tilt), star_pairs(count))
    P = [2.0 * np.sin(np.linalg.norm(v) / 2) * v / np.linalg.norm(v) for v in _logs(motion_c)]
    l1, l2, l3 = np.sqrt(np.linalg.eigvalsh(np.transpose(P) @ P))
    gain = 1 / (l1**2 + l2**2) + 1 / (l2**2 + l3**2) + 1 / (l3**2 + l1**2)
    return np.sqrt(PAIR_ROTATION * gain)


def _logs(motion: np.ndarray) -> np.ndarray:
    return rotations.log(motion[:, :3, :3])


def test_the_base_layout_has_the_papers_angle():
    assert np.degrees(Printed().theta) == pytest.approx([51.8, 51.8], abs=0.05)


@pytest.mark.parametrize("count", [3, 5, 8])
def test_rotation_sigma_is_equation_29(count):
    found = error_formulas.rotation_sigma(factors(count, star_pairs(count)), NOISE)
    assert found == pytest.approx(equation_29(count), rel=1e-10)
    largest = error_formulas.rotation_max(factors(count, star_pairs(count)), NOISE)
    ratio = PAIR_ROTATION_MAX / np.sqrt(PAIR_ROTATION)
    assert largest == pytest.approx(ratio * equation_29(count), rel=1e-10)


@pytest.mark.parametrize("tilt_deg", [1.0, 10.0, 20.0, 30.0])
def test_equation_29_and_28c_differ_as_worked_out(tilt_deg):
    """Three coplanar axes of length p at 60 degrees: both formulas by hand.

    With l1^2 = l2^2 = 3/2 p^2 and l3 = 0, (29) is sqrt(5/3 pair) / p with p = 2 sin(theta / 2),
    and (28c), which knows two of the three motions, is sqrt(16/9 pair) / theta. Their ratio is
    sqrt(15/16) theta / (2 sin(theta / 2)). A real tilt also lifts the axes out of their plane by
    an angle of the order of the tilt, which changes both by its square.
    """
    tilt = np.radians(tilt_deg)
    printed = Printed(tilt)
    small_angle = printed.theta[0] / (2.0 * np.sin(printed.theta[0] / 2.0))
    found = error_formulas.rotation_sigma(factors(3, star_pairs(3), tilt), NOISE)
    ratio = found / printed.equation_28c()
    assert ratio == pytest.approx(np.sqrt(15.0 / 16.0) * small_angle, rel=0.3 * tilt**2 + 1e-6)


@pytest.mark.parametrize("tilt_deg", [10.0, 30.0, 50.0])
def test_translation_sigma_of_two_motions_is_equation_31_and_32(tilt_deg):
    tilt = np.radians(tilt_deg)
    printed = Printed(tilt)
    found = error_formulas.translation_sigma(factors(3, CONSECUTIVE, tilt), NOISE)
    assert found == pytest.approx(printed.equation_31(), rel=1e-10)
    assert printed.moves[0] == pytest.approx(printed.moves[1], rel=0.2)
    assert found == pytest.approx(printed.equation_32(), rel=0.05)


def test_translation_sigma_of_the_whole_star_is_equation_32():
    # All three angles and axes are alike; only the gripper's ways differ, by its arm.
    found = error_formulas.translation_sigma(factors(3, star_pairs(3)), NOISE)
    assert found == pytest.approx(Printed().equation_32(), rel=0.05)


def test_translation_max_is_equation_33_without_its_root():
    printed = Printed()
    s = {name: MAX_OVER_RMS * value for name, value in vars(NOISE).items()}
    moves = np.sqrt(np.mean(printed.moves**2))
    first = 4.0 / printed.sine * PAIR_ROTATION_MAX * printed.T_c1
    second = 4.0 * (
        s["camera_rotation"] * printed.T_c1
        + s["camera_translation"]
        + s["robot_rotation"] * moves / 2.0
        + s["robot_translation"]
    )
    expected = (first + printed.condition * second) / (2.0 * np.sin(printed.theta[0] / 2.0))
    found = error_formulas.translation_max(factors(3, CONSECUTIVE), NOISE)
    assert found == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("count", [5, 7, 9, 15])
def test_more_stations_help_by_the_root_of_their_number(count):
    # For a small tilt the axes of any odd star are spread evenly in a plane: l1^2 = l2^2 =
    # N p^2 / 2, so (29) is sqrt(5 pair / N) / p; the star with more stations also turns farther.
    tilt = 1e-3
    three, many = factors(3, star_pairs(3), tilt), factors(count, star_pairs(count), tilt)
    lengths = np.sin(three.angle / 2) / np.sin(many.angle / 2)
    ratio = error_formulas.rotation_sigma(many, NOISE) / error_formulas.rotation_sigma(three, NOISE)
    assert ratio == pytest.approx(np.sqrt(3 / count) * lengths, rel=1e-5)


@pytest.mark.parametrize("count", [4, 12, 48])
def test_translation_scales_with_the_number_at_equal_factors(count):
    three = factors(3, star_pairs(3))
    many = FormulaFactors(**{**vars(three), "stations": count})
    for formula in (error_formulas.translation_sigma, error_formulas.translation_max):
        ratio = formula(many, NOISE) / formula(three, NOISE)
        assert ratio == pytest.approx(np.sqrt(3 / count), rel=1e-12)


def test_critical_factors_of_the_base_layout():
    found, printed = factors(3, star_pairs(3)), Printed()
    assert found.stations == 3
    assert found.angle == pytest.approx(printed.theta[0], rel=1e-12)
    assert found.sine == pytest.approx(printed.sine, rel=1e-12)
    assert found.condition == pytest.approx(printed.condition, rel=1e-12)
    assert found.camera_distance == pytest.approx(6.65 * INCH, rel=1e-12)


@pytest.mark.parametrize("count", [4, 7, 10])
def test_critical_factors_against_a_loop_over_pairs(count):
    pairs = star_pairs(count)
    found = factors(count, pairs)
    A, B = stations(count)
    turns = _logs(motions(A, B, pairs)[0])
    units = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    sines = [np.linalg.norm(np.cross(a, b)) for i, a in enumerate(units) for b in units[:i]]
    moves = [np.linalg.norm(A[i, :3, 3] - A[j, :3, 3]) for i, j in pairs]
    assert found.sine == pytest.approx(np.sqrt(np.mean(np.square(sines))), rel=1e-12)
    assert found.angle == pytest.approx(np.sqrt(np.mean(np.sum(turns**2, axis=1))), rel=1e-12)
    assert found.robot_distance == pytest.approx(np.sqrt(np.mean(np.square(moves))), rel=1e-12)


@pytest.mark.parametrize("choose", [star_pairs, all_pairs])
@pytest.mark.parametrize("count", [3, 6, 9])
def test_successive_axes_against_a_loop_over_stations(count, choose):
    pairs = choose(count)
    A, B = stations(count)
    motion_g, motion_c = motions(A, B, pairs)
    units = _logs(motion_g) / np.linalg.norm(_logs(motion_g), axis=1, keepdims=True)
    expected = []
    for station in range(count):
        touching = [k for k, pair in enumerate(pairs) if station in pair]
        for k, m in itertools.pairwise(touching):
            expected.append(np.arccos(min(abs(units[k] @ units[m]), 1.0)))
    for motion in (motion_g, motion_c):
        found = error_formulas.successive_axes_angles(motion, pairs)
        assert len(found) == 2 * len(pairs) - count
        np.testing.assert_allclose(np.sort(found), np.sort(expected), atol=1e-7)


def test_motions_without_rotation_are_across_nothing():
    A, B = stations(6)
    pairs = star_pairs(6)
    _, motion_c = motions(A, B, pairs)
    turning = error_formulas.critical_factors(A, B, motion_c, pairs)
    with_rest = np.concatenate([motion_c, np.tile(np.eye(4), (4, 1, 1))])
    resting = np.concatenate([pairs, pairs[:4]])
    found = error_formulas.critical_factors(A, B, with_rest, resting)
    assert found.sine == pytest.approx(turning.sine, rel=1e-12)
    still = np.tile(np.eye(4), (3, 1, 1))
    assert error_formulas.critical_factors(A, B, still, star_pairs(3)).sine == 0.0


def test_a_motion_without_rotation_has_no_axis():
    still = np.tile(np.eye(4), (3, 1, 1))
    assert not error_formulas.successive_axes_angles(still, star_pairs(3)).any()


def simulated(count: int, trials: int, seed: int) -> np.ndarray:
    """Rotation and translation errors (trials, 2) of the paper's method on noisy stations."""
    A, B = stations(count)
    rng = np.random.default_rng(seed)
    levels = np.array(
        [
            [NOISE.robot_translation] * 3 + [NOISE.robot_rotation] * 3,
            [NOISE.camera_translation] * 3 + [NOISE.camera_rotation] * 3,
        ]
    ) / np.sqrt(3.0)
    drawn = levels[:, None, None] * rng.normal(size=(2, trials, count, 6))
    problem = Problem(
        se3.perturb(A, drawn[0]),
        se3.perturb(B, drawn[1]),
        star_pairs(count),
        np.tile(np.eye(12), (count, 1, 1)),
    )
    error = se3.difference(tsai_lenz.solve(problem).X, X)
    return np.linalg.norm(error.reshape(trials, 2, 3)[:, ::-1], axis=-1)


@pytest.mark.parametrize("count", [3, 5, 9])
def test_predictions_against_simulated_calibrations(count):
    errors = simulated(count, 1000, count)
    rotation, translation = np.sqrt(np.mean(errors**2, axis=0))
    known = factors(count, star_pairs(count))
    assert 1.0 < error_formulas.rotation_sigma(known, NOISE) / rotation < 1.6
    assert 1.5 < error_formulas.translation_sigma(known, NOISE) / translation < 4.0
    assert np.max(errors[:, 0]) < error_formulas.rotation_max(known, NOISE)
    assert np.max(errors[:, 1]) < error_formulas.translation_max(known, NOISE)


def test_the_base_layout_errs_as_the_design_says():
    """3.15 mrad and 27.1 mil; an RMS of 1000 trials has a deviation of about 2 %."""
    rotation, translation = np.sqrt(np.mean(simulated(3, 1000, 1) ** 2, axis=0))
    assert rotation / MRAD == pytest.approx(3.15, rel=0.1)
    assert translation / MIL == pytest.approx(27.1, rel=0.1)
