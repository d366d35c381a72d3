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


def test_where_both_explain_as_much_both_are_named_with_how_well_they_fit():
    """Seven stations on a circle: each explanation leaves four of them."""
    rng = np.random.default_rng(0)
    document = recording(rng, scene(rng, 7), Noise(1e-3, 2e-4, 1e-3, 1e-4))
    step = [-0.01338575, -0.01398757, 0.00501692, 0.04948565, -0.00821473, -0.05371824]
    (error,) = found_in(moved(document, 3, step)).errors
    assert error.code == "lists-shifted"
    before, after = error.message.split(", and as well ")
    assert " deg if the target poses belong to the robot poses 2 places earlier" in before
    assert after.endswith(' deg if the target was moved between stations "02" and "03"')
    assert float(after.split()[0]) < 0.2  # noise: 1 mrad is 0.06 deg
