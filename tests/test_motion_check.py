"""Lengths that contradict each other, and good data of every kind that do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry.observability import screw_scale
from handeye_cli.geometry.star import star_pairs
from handeye_cli.motion_check import check_motions
from handeye_cli.records import Noise, UncertainPose
from handeye_cli.solve import solve
from handeye_cli.solvers.motions import interstation_motions

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def scaled(pose, factor):
    return np.block([[pose[:3, :3], factor * pose[:3, 3:]], [np.zeros(3), 1.0]])


def with_robot(document, factor):
    rows = [replace(s, base_T_gripper=scaled(s.base_T_gripper, factor)) for s in document.stations]
    return replace(document, stations=tuple(rows))


def with_target(document, factor):
    rows = [
        replace(s, camera_T_target=UncertainPose(scaled(s.camera_T_target.matrix, factor)))
        for s in document.stations
    ]
    return replace(document, stations=tuple(rows))


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_millimetres_for_metres_are_named(setup, factor):
    rng = np.random.default_rng(3)
    document = stations(rng, general_scene(rng, 10), NOISE, setup=setup)
    with pytest.raises(UndeterminedError, match="times as long") as caught:
        solve(with_robot(document, factor))
    told = float(caught.value.message.split("motions are ")[1].split()[0])
    assert told == pytest.approx(factor, rel=0.01)
    assert "in one unit, m or mm" in caught.value.hint


@pytest.mark.parametrize("factor", [0.7, 1.27])
def test_a_wrong_size_of_the_target_is_told_with_its_factor(factor):
    rng = np.random.default_rng(5)
    document = stations(rng, general_scene(rng, 10), NOISE)
    with pytest.raises(UndeterminedError) as caught:
        solve(with_target(document, 1.0 / factor))
    told = float(caught.value.message.split("if the target is ")[1].split()[0])
    assert told == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize("setup", Setup)
def test_a_camera_hundreds_of_metres_away_is_refused(setup):
    """On the paper's circle no motion has a translation along its axis; the answer's size tells."""
    rng = np.random.default_rng(7)
    document = stations(rng, scene(rng, 8), NOISE, setup=setup)
    with pytest.raises(UndeterminedError, match=r"within 50 m, .* \d+ m away") as caught:
        solve(with_robot(document, 1000.0))
    assert "in one unit, m or mm" in caught.value.hint


@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [3, 6, 7, 12])
def test_good_data_raise_no_alarm_up_to_ten_milliradians_and_five_millimetres(layout, count):
    rng = np.random.default_rng(count)
    pairs = star_pairs(count)
    for level in (1e-3, 0.1, 1.0):
        joint = joint_covariance(count, Noise(*2 * (level * 1e-2, level * 5e-3)))
        for _ in range(20):
            perfect = layout(rng, count)
            document = stations(rng, perfect, NOISE)
            chain = replace(
                chain_of(document),
                A=disturbed(rng, perfect.A, joint[:, :6, :6]),
                B=disturbed(rng, perfect.B, joint[:, 6:, 6:]),
            )
            check_motions(chain, pairs, Setup.EYE_IN_HAND)


def test_the_ratio_is_right_within_its_sigma():
    rng = np.random.default_rng(11)
    joint = joint_covariance(30, NOISE)
    pulls = []
    for _ in range(60):
        perfect = general_scene(rng, 30)
        A = disturbed(rng, perfect.A, joint[:, :6, :6])
        B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
        A[:, :3, 3] *= 1.3
        found = screw_scale(*interstation_motions(A, B, star_pairs(30)))
        pulls.append((found.ratio / 1.3 - 1.0) / found.sigma)
    # pairs share stations, so the scatter is not that of independent pairs
    assert 0.5 < np.sqrt(np.mean(np.square(pulls))) < 2.0


def test_lengths_that_are_noise_are_not_compared():
    """On a circle nothing moves along an axis: whatever ratio the noise has, it means nothing."""
    rng = np.random.default_rng(93)  # one recording of 300 whose noise looks like a ratio
    document = stations(rng, scene(rng, 7), Noise(1e-3, 2e-4, 1e-4, 1e-5))
    chain, pairs = chain_of(document), star_pairs(7)
    found = screw_scale(*interstation_motions(chain.A, chain.B, pairs))
    assert abs(np.log(found.ratio)) > 8.0 * found.sigma
    check_motions(chain, pairs, document.setup)
