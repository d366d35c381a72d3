"""The closed form against the paper's formula written out with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, problem
from scipy.linalg import inv, sqrtm
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import star
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, park_martin

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)


def as_printed(A, B, pairs):
    """R = (M'M)^(-1/2) M' with M = sum beta alpha', then the linear equations for T."""
    M, rows, right = np.zeros((3, 3)), [], []
    motions = [(np.linalg.inv(A[j]) @ A[i], B[j] @ np.linalg.inv(B[i])) for i, j in pairs]
    for Hg, Hc in motions:
        alpha, beta = (Rotation.from_matrix(H[:3, :3]).as_rotvec() for H in (Hg, Hc))
        M += np.outer(beta, alpha)
    R = inv(np.real(sqrtm(M.T @ M))) @ M.T
    for Hg, Hc in motions:
        rows.append(Hg[:3, :3] - np.eye(3))
        right.append(R @ Hc[:3, 3] - Hg[:3, 3])
    T = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    return R, T


@pytest.mark.parametrize("choose", [star.star_pairs, star.all_pairs])
@pytest.mark.parametrize("count", [4, 7, 10])
def test_noisy_stations_give_what_the_equations_give(count, choose):
    rng = np.random.default_rng(count)
    for _ in range(5):
        at = problem(general_scene(rng, count), NOISE, pairs=choose(count))
        A = disturbed(rng, at.A, at.covariance[:, :6, :6])
        B = disturbed(rng, at.B, at.covariance[:, 6:, 6:])
        found = park_martin.solve(Problem(A, B, at.pairs, at.covariance))
        R, T = as_printed(A, B, at.pairs)
        np.testing.assert_allclose(found.X[:3, :3], R, atol=1e-8)
        np.testing.assert_allclose(found.X[:3, 3], T, atol=1e-8)
