"""What the stations leave open: found at any noise, named in words, and refused."""

from __future__ import annotations

import numpy as np
import pytest
from degenerate_scenes import COUNTS, HIGH, LOW, NO_NOISE, chain_of_any, degenerate, noisy
from scenes import general_scene, joint_covariance, stations

from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.undetermined import explain, free_directions, named, vector_text
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import se3
from handeye_cli.geometry.free_directions import Freedom
from handeye_cli.geometry.observability import motion_spread
from handeye_cli.geometry.star import star_pairs
from handeye_cli.motion_check import check_certainty, check_count, check_freedom, check_motions
from handeye_cli.records import Noise, PosePart, PredictedError
from handeye_cli.solve import solve
from handeye_cli.solvers.motions import interstation_motions

NONE = np.zeros((0, 3))
Z_AXIS = np.array([[0.0, 0.0, 1.0]])


SETTINGS = [(Setup.EYE_IN_HAND, True), (Setup.EYE_TO_HAND, False)]
LEVELS = {"none": NO_NOISE, "low": LOW, "high": HIGH}
CASES = [
    (kind, level, *SETTINGS[(i + k) % 2])  # by turns in either setting
    for i, kind in enumerate(COUNTS)
    for k, level in enumerate(LEVELS)
]


def refuse(document, chain):
    check_count(chain, document.setup, len(document.stations))
    check_motions(chain, star_pairs(len(chain.A)), document.setup)


@pytest.mark.parametrize(("kind", "level", "setup", "camera_known"), CASES)
def test_degenerate_stations_are_refused_with_the_right_direction(kind, level, setup, camera_known):
    noise = LEVELS[level]
    with_covariance = camera_known and noise is not NO_NOISE
    perfect, document, chain = noisy(kind, 1, noise, setup=setup, with_covariance=with_covariance)
    free = free_directions(chain)
    assert free.counts == COUNTS[kind]
    with pytest.raises(UndeterminedError) as caught:
        refuse(document, chain)
    assert caught.value.exit_code == 4
    assert "--partial" in caught.value.hint
    assert setup.answer in caught.value.message
    axes = [each[0] for each in (free.rotations, free.translations) if len(each) == 1]
    # turns and shifts spread by half a radian and 0.1 m; in eye-to-hand the lever adds to the noise
    spread = np.sqrt(len(chain.A)) * np.array([0.5, 0.1])
    sigma = np.linalg.norm([noise.robot_rotation, noise.camera_rotation]) / spread[0]
    if kind == "one translation":
        sigma = np.linalg.norm([noise.robot_translation, 0.5 * noise.robot_rotation]) / spread[1]
    for axis in axes:
        assert np.linalg.norm(np.cross(axis, perfect.axis)) < 4.0 * sigma + 1e-7
        assert vector_text(axis, setup.mount) in caught.value.message


@pytest.mark.parametrize("kind", COUNTS)
def test_the_calibration_refuses_them_for_that_and_nothing_else(kind):
    _, document, chain = noisy(kind, 2, LOW)
    with pytest.raises(UndeterminedError) as caught:
        solve(document)
    assert caught.value.message.endswith(explain(free_directions(chain), document.setup))


@pytest.mark.parametrize("noise", LEVELS.values(), ids=LEVELS)
@pytest.mark.parametrize("count", [3, 10])
def test_well_determined_stations_have_nothing_free(count, noise):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        document = stations(rng, general_scene(rng, count), noise, with_covariance=False)
        assert free_directions(chain_of_any(document)).counts == (0, 0)


def test_a_single_station_determines_nothing():
    _, document, chain = noisy("one axis", 1, LOW)
    single = chain.part(slice(1))
    assert free_directions(single).counts == (3, 3)
    with pytest.raises(UndeterminedError, match="found 1 of 8: nothing of gripper_T_camera is"):
        check_count(single, document.setup, 8)
    check_count(chain, document.setup, 8)


def test_given_noise_decides_what_is_motion():
    """Tilts of 10 mrad are motion at 0.1 mrad and nothing at 10 mrad, whatever residuals say."""
    rng = np.random.default_rng(5)
    perfect = degenerate("second axis in the noise", rng, noise=Noise(0.03, 0.0, 0.0, 0.0))
    chain = chain_of_any(stations(rng, perfect, NO_NOISE, with_covariance=False))
    for level, counts in ((1e-4, (0, 0)), (1e-2, (1, 1))):
        assert free_directions(chain, Noise(level, level, level, level)).counts == counts


@pytest.mark.parametrize(
    ("free", "text"),
    [
        (
            Freedom(Z_AXIS, Z_AXIS),
            "not determined are the translation of gripper_T_camera along the gripper's z axis "
            "(0.00, 0.00, 1.00), and its rotation about that axis",
        ),
        (
            Freedom(NONE, np.array([[0.6, 0.0, 0.8]])),
            "not determined is the translation of gripper_T_camera along (0.60, 0.00, 0.80) in "
            "the gripper frame; its rotation is determined",
        ),
        (
            Freedom(NONE, np.eye(3)),
            "not determined is the whole translation of gripper_T_camera; its rotation is "
            "determined",
        ),
        (
            Freedom(np.array([[0.02, 0.9998, -0.001]]), np.eye(3)),
            "not determined are the whole translation of gripper_T_camera, and its rotation about "
            "the gripper's y axis (0.02, 1.00, 0.00)",
        ),
        (Freedom(np.eye(3), np.eye(3)), "nothing of gripper_T_camera is determined"),
    ],
)
def test_the_words(free, text):
    assert explain(free, Setup.EYE_IN_HAND) == text
    in_base = text.replace("gripper", "base")
    assert explain(free, Setup.EYE_TO_HAND) == in_base


def test_every_direction_has_its_own_words_and_vector():
    found = named(Freedom(Z_AXIS, np.eye(3)), Setup.EYE_TO_HAND)
    assert [each.part for each in found] == [PosePart.ROTATION] + 3 * [PosePart.TRANSLATION]
    assert found[0].words == "rotation about the base's z axis (0.00, 0.00, 1.00)"
    assert found[1].words == "translation along the base's x axis (1.00, 0.00, 0.00)"
    assert {each.frame for each in found} == {"base"}
    np.testing.assert_array_equal(found[2].direction, [0.0, 1.0, 0.0])


def test_a_scara_robot_keeps_its_rotation():
    """The same turns with translations across their axis settle what the turns alone do not."""
    for kind, settled in (("one axis", False), ("scara", True)):
        _, document, chain = noisy(kind, 7, LOW)
        with pytest.raises(UndeterminedError, match="found only one") as caught:
            refuse(document, chain)
        assert caught.value.message.endswith("its rotation is determined") is settled
        assert caught.value.message.endswith("its rotation about that axis") is not settled


def test_a_predicted_error_that_leaves_nothing_names_what_is_free():
    for kind, end in (("one axis", "about that axis"), ("scara", "rotation is determined")):
        rng = np.random.default_rng(3)
        perfect = degenerate(kind, rng, axis=[0.0, 0.0, 1.0])
        document = stations(rng, perfect, LOW)
        chain, setup = chain_of_any(document), document.setup
        spread = motion_spread(*interstation_motions(chain.A, chain.B, star_pairs(8)))
        noise = joint_covariance(8, LOW)
        error = PredictedError(0.4, 1.0, 0.7, 2.0)
        with pytest.raises(UndeterminedError) as caught:
            check_certainty(error, noise, spread, setup, chain=chain)
        assert "the gripper's z axis (0.00, 0.00, 1.00)" in caught.value.message
        assert caught.value.message.endswith(end)
        with pytest.raises(UndeterminedError, match="its rotation about that axis"):
            check_certainty(error, noise, spread, setup)


def test_a_failed_estimation_is_blamed_on_free_directions_where_there_are_any():
    _, document, chain = noisy("one translation", 3, LOW)
    with pytest.raises(UndeterminedError, match="the whole translation of gripper_T_camera, and"):
        check_freedom(chain, None, document.setup)
    rng = np.random.default_rng(4)
    good = stations(rng, general_scene(rng, 6), LOW)
    check_freedom(chain_of_any(good), None, good.setup)


def test_lifting_along_the_axis_alone_settles_nothing():
    """A screw of any pitch about one line leaves the rotation about the line free."""
    rng = np.random.default_rng(9)
    perfect = degenerate("one axis", rng)
    lift = 0.2 * rng.normal(size=(8, 1)) * perfect.axis
    A = perfect.A @ se3.from_parts(np.eye(3), lift)
    B = se3.inverse(perfect.X) @ se3.inverse(A) @ perfect.Z
    lifted = type(perfect)(A, B, perfect.X, perfect.Z, perfect.axis)
    document = stations(rng, lifted, LOW)
    assert free_directions(chain_of_any(document)).counts == (1, 1)
