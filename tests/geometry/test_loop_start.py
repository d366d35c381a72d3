"""Starts for all kinds of stations: the loops close, and what is free stays where it was."""

from __future__ import annotations

import numpy as np
import pytest
from degenerate_scenes import COUNTS, degenerate
from scenes import disturbed, general_scene, joint_covariance

from handeye_cli.geometry import loop_start, rotations
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.loop_start import close_loops
from handeye_cli.records import Noise

SCENES = {"general": general_scene} | {
    kind: lambda rng, count, kind=kind: degenerate(kind, rng, count) for kind in COUNTS
}


@pytest.mark.parametrize("kind", SCENES)
def test_loops_close_from_anywhere(kind):
    for seed in range(6):
        perfect = SCENES[kind](np.random.default_rng(seed), 6)
        X, Z = close_loops(perfect.A, perfect.B)
        left = loop_jacobians(perfect.A, perfect.B, X, Z).residuals
        assert np.max(np.abs(left)) < 1e-6


@pytest.mark.parametrize("kind", SCENES)
def test_noisy_loops_close_up_to_their_noise(kind):
    """Residuals are of the size of the noise and its levers, not of that of a wrong basin."""
    noise = Noise(3e-3, 1e-3, 1e-3, 3e-4)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        perfect = SCENES[kind](rng, 6)
        joint = joint_covariance(len(perfect.A), noise)
        A = disturbed(rng, perfect.A, joint[:, :6, :6])
        B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
        left = loop_jacobians(A, B, *close_loops(A, B)).residuals
        assert np.sqrt(np.mean(left[:, 3:] ** 2)) < 3.0 * noise.robot_rotation
        assert np.sqrt(np.mean(left[:, :3] ** 2)) < 3.0 * 2e-3


def test_every_rotation_is_near_a_start():
    starts = rotations.quaternion_from_matrix(loop_start._spread_rotations())
    random = np.random.default_rng(5).normal(size=(5000, 4))
    random /= np.linalg.norm(random, axis=1, keepdims=True)
    nearest = np.max(np.abs(random @ starts.T), axis=1)
    assert len(starts) == 40
    assert np.degrees(2.0 * np.arccos(np.min(nearest))) < 61.0
