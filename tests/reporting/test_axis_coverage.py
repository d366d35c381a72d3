"""Axes of rotations on a disc that keeps areas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reporting import cases

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Station, Stations, UncertainPose
from handeye_cli.reporting.axis_coverage import axis_coverage, on_disc
from handeye_cli.reporting.case import Case


def turned(turns, setup=Setup.EYE_IN_HAND):
    poses = se3.from_parts(rotations.exp(np.array(turns)), np.zeros(3))
    rows = tuple(
        Station(str(i), pose, camera_T_target=UncertainPose(np.eye(4)))
        for i, pose in enumerate(poses)
    )
    return Case("a", stations=Stations(setup, rows))


def test_the_map_keeps_areas():
    axes = np.random.default_rng(3).normal(size=(40_000, 3))
    places = on_disc(axes / np.linalg.norm(axes, axis=1, keepdims=True))
    radius = np.linalg.norm(places, axis=1)
    assert radius.max() <= 1.0 + 1e-12
    # uniform directions fill the disc uniformly: the squares of the radii are uniform
    inside = np.mean(radius[:, None] < np.sqrt([0.25, 0.5, 0.75]), axis=0)
    np.testing.assert_allclose(inside, [0.25, 0.5, 0.75], atol=4 * 0.5 / np.sqrt(40_000))


def test_an_axis_and_its_opposite_are_one_place():
    axes = np.array([[0.6, 0.0, 0.8], [0.0, 0.6, -0.8]])
    np.testing.assert_allclose(on_disc(axes), on_disc(-axes))


@pytest.mark.parametrize(
    ("axis", "place"), [([0, 0, 1], [0, 0]), ([1, 0, 0], [1, 0]), ([0, 1, 0], [0, 1])]
)
def test_the_frames_own_axes_are_where_they_are_drawn(axis, place):
    coverage = axis_coverage(turned([np.zeros(3), 0.4 * np.array(axis, float)]))
    np.testing.assert_allclose(np.abs(coverage.places[0]), place, atol=1e-12)
    np.testing.assert_allclose(coverage.angles, [0.4])


def test_pairs_that_do_not_turn_have_no_axis():
    coverage = axis_coverage(turned([np.zeros(3), np.zeros(3), [0.2, 0, 0]]))
    assert len(coverage.places) == 2


def test_the_pairs_of_the_answer_stand_out():
    coverage = axis_coverage(cases.case())
    assert coverage.frame == "gripper"
    assert len(coverage.places) == cases.COUNT * (cases.COUNT - 1) // 2
    assert coverage.chosen.sum() == len(cases.calibration().pairs)


def test_stations_that_were_left_out_do_not_count():
    answer = cases.calibration()
    unused = replace(answer.stations[0], used=False)
    answer = replace(answer, stations=(unused, *answer.stations[1:]))
    coverage = axis_coverage(replace(cases.case(), calibration=answer))
    assert len(coverage.places) == (cases.COUNT - 1) * (cases.COUNT - 2) // 2


def test_a_fixed_camera_turns_about_axes_of_the_base():
    assert axis_coverage(cases.case(Setup.EYE_TO_HAND)).frame == "base"


def test_one_station_has_no_axes():
    assert axis_coverage(turned([np.zeros(3)])) is None
