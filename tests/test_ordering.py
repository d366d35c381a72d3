"""Plates that look the same after a turn, numbered alike at all stations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pictures import grid, quarter_turns, renumbered, shoot

from handeye_cli.conventions import Setup
from handeye_cli.ordering import order_consistently

POINTS = grid(6, 6, 0.005)
TURNS = quarter_turns(6)


def common_turn(truth, ordered):
    """The one turn under which every station's pixels are the true ones, or None."""
    for index, turn in enumerate(TURNS):
        if all(
            np.array_equal(found.observation.pixels, true.observation.pixels[turn])
            for found, true in zip(ordered.stations, truth.stations, strict=True)
        ):
            return index
    return None


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("tilt_deg", [3.0, 15.0, 35.0])
def test_random_turns_become_one(setup, tilt_deg):
    rng = np.random.default_rng(int(tilt_deg))
    for _ in range(3):
        shot = shoot(rng, 9, tilt_deg=tilt_deg, setup=setup)
        picks = rng.integers(0, 4, 9)
        ordered = order_consistently(renumbered(shot.features, TURNS, picks), POINTS, TURNS)
        assert common_turn(shot.features, ordered) == picks[0]


def test_without_intrinsics_they_are_calibrated_first():
    rng = np.random.default_rng(5)
    shot = shoot(rng, 9)
    picks = rng.integers(0, 4, 9)
    blind = replace(renumbered(shot.features, TURNS, picks), camera=None)
    ordered = order_consistently(blind, POINTS, TURNS)
    assert common_turn(shot.features, ordered) == picks[0]
    assert ordered.camera is None


def test_one_wrong_image_does_not_turn_the_others():
    rng = np.random.default_rng(7)
    shot = shoot(rng, 9)
    picks = rng.integers(0, 4, 9)
    turned = renumbered(shot.features, TURNS, picks)
    wrong = turned.stations[4].observation
    scrambled = replace(wrong, pixels=rng.uniform(100, 400, wrong.pixels.shape))
    rows = list(turned.stations)
    rows[4] = replace(rows[4], observation=scrambled)
    ordered = order_consistently(replace(turned, stations=tuple(rows)), POINTS, TURNS)
    kept = [i for i in range(9) if i != 4]
    truth = replace(shot.features, stations=tuple(shot.features.stations[i] for i in kept))
    found = replace(ordered, stations=tuple(ordered.stations[i] for i in kept))
    assert common_turn(truth, found) == picks[0]


def test_ids_come_out_sorted_and_partial_views_keep_theirs():
    rng = np.random.default_rng(11)
    shot = shoot(rng, 8)
    picks = rng.integers(0, 4, 8)
    turned = renumbered(shot.features, TURNS, picks)
    half = [i for i in range(36) if i % 6 < 4]
    seen = turned.stations[3].observation
    rows = list(turned.stations)
    rows[3] = replace(
        rows[3], observation=replace(seen, ids=seen.ids[half], pixels=seen.pixels[half])
    )
    ordered = order_consistently(replace(turned, stations=tuple(rows)), POINTS, TURNS)
    partial = ordered.stations[3].observation
    assert np.all(np.diff(partial.ids) > 0)
    truth = shot.features.stations[3].observation.pixels[TURNS[picks[0]]]
    np.testing.assert_array_equal(partial.pixels, truth[partial.ids])


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_views_are_left_alone(count):
    rng = np.random.default_rng(13)
    features = shoot(rng, 5).features
    few = replace(features, stations=features.stations[:count])
    assert order_consistently(few, POINTS, TURNS) is few
