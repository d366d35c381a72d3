"""A target that was moved against lists that are shifted, where both leave alike residuals."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis.mistakes import (
    QUIET,
    camera,
    driven_circle,
    near_planar,
    recording,
    shifted,
    with_camera,
)
from scenes import general_scene, scene

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.conventions import judge_conventions
from handeye_cli.examination import examine
from handeye_cli.geometry import se3
from handeye_cli.records import Noise
from handeye_cli.solve import solve

LAYOUTS = {
    "circle": scene,
    "driven": driven_circle,
    "general": general_scene,
    "near-planar": near_planar,
}


def moved(document, first, step):
    poses = camera(document)
    poses[first:] = poses[first:] @ se3.perturb(np.eye(4), np.asarray(step))
    return with_camera(document, poses)


def found_in(document):
    return examine(document, chain_of(document))


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("metres", [0.02, 0.2])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_moved_target_is_named_and_its_smaller_side_left_out(layout, metres, setup):
    rng = np.random.default_rng(71)
    document = recording(rng, LAYOUTS[layout](rng, 9), setup=setup)
    examined = found_in(moved(document, 5, [metres, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert not examined.errors
    (warning,) = (each for each in examined.findings if each.severity != "info")
    assert warning.code == "target-moved"
    assert 'between stations "04" and "05"' in warning.message
    told = float(warning.message.split("see the target ")[1].split()[0])
    # the place of a target that stands still is known to about the noise of a station
    assert told == pytest.approx(1e3 * metres, abs=5e3 * QUIET.robot_translation)
    assert set(examined.reasons) == {5, 6, 7, 8}


def test_the_verdict_prefers_the_move_and_tells_its_fit():
    rng = np.random.default_rng(73)
    wrong = moved(recording(rng, scene(rng, 9)), 5, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    verdict = judge_conventions(wrong, chain_of(wrong))
    assert not verdict.contradiction
    assert verdict.best.code == "target-moved"
    assert verdict.best.description.endswith('moved between stations "04" and "05"')
    assert verdict.declared.translation > 5e-3
    # what is left is the noise of a loop: a station's own, and its rotation at the camera's lever
    assert 0.3 * QUIET.robot_translation < verdict.best.translation < 1e-3
    assert "lists-shifted" in {each.code for each in verdict.hypotheses}


def test_the_answer_on_one_side_of_the_move_is_that_without_a_move():
    rng = np.random.default_rng(75)
    perfect = scene(rng, 9)
    wrong = moved(recording(rng, perfect), 5, [0.02, 0.0, 0.0, 0.0, 0.0, 0.0])
    answer = solve(wrong)
    error = se3.difference(answer.mount_T_camera.matrix, perfect.X)
    promised = answer.predicted_error
    assert np.linalg.norm(error[3:]) < 3.0 * promised.rotation
    assert np.linalg.norm(error[:3]) < 3.0 * promised.translation


@pytest.mark.parametrize("layout", [driven_circle, general_scene])
@pytest.mark.parametrize("places", [1, 2])
def test_shifted_lists_remain_shifted_lists(layout, places):
    rng = np.random.default_rng(77)
    examined = found_in(shifted(recording(rng, layout(rng, 10)), places))
    (error,) = examined.errors
    assert error.code == "lists-shifted"
    assert "target was moved" not in error.message


LOUD = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def moved_by_chance(seed, count):
    """Stations on a circle, and a move of 20 mm and some degrees after a random one of them."""
    rng = np.random.default_rng(seed)
    document = recording(rng, scene(rng, count), LOUD)
    first = int(rng.integers(2, count - 1))
    step = rng.normal(size=6)
    step[:3] *= 0.02 / np.linalg.norm(step[:3])
    step[3:] *= 0.05
    return moved(document, first, step)


def test_the_noise_of_a_pairing_is_no_fault_of_a_move():
    """Seven stations, of which five fix the move's noise so low that three would not agree."""
    rng = np.random.default_rng(0)
    document = recording(rng, scene(rng, 7), LOUD)
    step = [-0.01338575, -0.01398757, 0.00501692, 0.04948565, -0.00821473, -0.05371824]
    examined = found_in(moved(document, 3, step))
    (warning,) = (each for each in examined.findings if each.severity != "info")
    assert warning.code == "target-moved"
    assert set(examined.reasons) == {0, 1, 2}


def test_where_both_explain_as_much_both_are_named_with_how_well_they_fit():
    """Six stations, four before the move, and two that pairing them otherwise leaves out."""
    (error,) = found_in(moved_by_chance(3, 6)).errors
    assert error.code == "lists-shifted"
    before, after = error.message.split(", and as well ")
    assert " deg if the target poses belong to the robot poses " in before
    assert after.endswith(' deg if the target was moved between stations "03" and "04"')
    assert float(after.split()[0]) < 0.2  # noise: 1 mrad is 0.06 deg


PLAIN = Noise(2e-4, 5e-5, 3e-5, 2e-6)


@pytest.mark.parametrize("seed", [9, 30, 31])
def test_a_ratio_of_lengths_that_a_circle_leaves_open_does_not_speak_for_a_shift(seed):
    """A third of a turn maps the stations onto each other, and most of them keep one place."""
    rng = np.random.default_rng(seed)
    document = recording(rng, scene(np.random.default_rng(70), 12), PLAIN)
    examined = found_in(moved(document, 5, [0.02, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert not examined.errors
    (warning,) = (each for each in examined.findings if each.severity != "info")
    assert warning.code == "target-moved"
    assert set(examined.reasons) == {0, 1, 2, 3, 4}
