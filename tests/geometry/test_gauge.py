"""Where the free part of an answer is put: against a search over all places it could have."""

from __future__ import annotations

import numpy as np
import pytest
from degenerate_scenes import degenerate
from scenes import unit

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.free_directions import NOTHING_FREE, Freedom
from handeye_cli.geometry.gauge import at_gauge, gauge_step
from handeye_cli.geometry.loop import loop_jacobians

NONE = np.zeros((0, 3))


def pose(rng):
    return se3.from_parts(rotations.exp(rng.normal(size=3)), rng.normal(size=3))


@pytest.mark.parametrize("seed", range(8))
def test_a_free_rotation_is_the_nearest_of_all_turns(seed):
    rng = np.random.default_rng(seed)
    X, near, axis = pose(rng), pose(rng), unit(rng)
    turn = gauge_step(X, near, Freedom(axis[None], axis[None]))[3:6]
    angles = np.linspace(-np.pi, np.pi, 20001)
    all_turned = rotations.exp(angles[:, None] * axis) @ X[:3, :3] @ near[:3, :3].T
    best = angles[np.argmin(rotations.angle(all_turned))]
    assert (turn @ axis - best + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0.0, abs=2e-3)
    np.testing.assert_allclose(turn, axis * (axis @ turn), atol=1e-15)


def test_a_wholly_free_pose_is_the_guess():
    rng = np.random.default_rng(11)
    X, near = pose(rng), pose(rng)
    step = gauge_step(X, near, Freedom(np.eye(3), np.eye(3)))
    np.testing.assert_allclose(se3.perturb(X, step[:6]), near, atol=1e-14)
    np.testing.assert_array_equal(step[6:], 0.0)


def test_only_the_free_part_of_a_translation_moves():
    rng = np.random.default_rng(12)
    X, near, axis = pose(rng), pose(rng), unit(rng)
    step = gauge_step(X, near, Freedom(NONE, axis[None]))
    assert axis @ (X[:3, 3] + step[:3]) == pytest.approx(axis @ near[:3, 3], abs=1e-14)
    np.testing.assert_allclose(np.cross(step[:3], axis), 0.0, atol=1e-14)
    np.testing.assert_array_equal(gauge_step(X, near, NOTHING_FREE), 0.0)


@pytest.mark.parametrize(
    ("kind", "free"),
    [
        ("one axis", lambda a: Freedom(a, a)),
        ("scara", lambda a: Freedom(NONE, a)),
        ("translations", lambda _: Freedom(NONE, np.eye(3))),
        ("one translation", lambda a: Freedom(a, np.eye(3))),
        ("identical poses", lambda _: Freedom(np.eye(3), np.eye(3))),
    ],
)
def test_a_long_way_along_the_free_directions_keeps_the_loops_closed(kind, free):
    rng = np.random.default_rng(13)
    perfect, near = degenerate(kind, rng), pose(rng)
    freedom = free(perfect.axis[None])
    X, Z = at_gauge(perfect.A, perfect.B, perfect.X, near, freedom)
    assert np.max(np.abs(loop_jacobians(perfect.A, perfect.B, X, Z).residuals)) < 1e-12
    assert np.max(np.abs(gauge_step(X, near, freedom))) < 1e-12
