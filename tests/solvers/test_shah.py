"""The rotations against the singular vectors of the sum of Kronecker products."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, problem, scene

from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, shah

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)


def nearest_rotation(column):
    M = column.reshape(3, 3, order="F")
    U, _, Vt = np.linalg.svd(np.sign(np.linalg.det(M)) * M)
    return U @ Vt


def as_published(A, B):
    """vec(R_A R_X) = vec(R_Z R_Q), column by column, then the translations together."""
    Q = np.linalg.inv(B)
    K = sum(np.kron(q[:3, :3], a[:3, :3]) for a, q in zip(A, Q, strict=True))
    U, _, Vt = np.linalg.svd(K)
    R_X, R_Z = nearest_rotation(Vt[0]), nearest_rotation(U[:, 0])
    rows = np.concatenate([np.hstack([np.eye(3), -a[:3, :3]]) for a in A])
    right = np.concatenate([a[:3, 3] - R_Z @ q[:3, 3] for a, q in zip(A, Q, strict=True)])
    t = np.linalg.lstsq(rows, right, rcond=None)[0]
    return (R_X, t[3:]), (R_Z, t[:3])


@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [3, 7, 10])
def test_noisy_stations_give_the_singular_vectors(count, layout):
    rng = np.random.default_rng(count)
    for _ in range(5):
        at = problem(layout(rng, count), NOISE)
        A = disturbed(rng, at.A, at.covariance[:, :6, :6])
        B = disturbed(rng, at.B, at.covariance[:, 6:, 6:])
        found = shah.solve(Problem(A, B, at.pairs, at.covariance))
        for pose, (R, t) in zip((found.X, found.Z), as_published(A, B), strict=True):
            np.testing.assert_allclose(pose[:3, :3], R, atol=1e-8)
            np.testing.assert_allclose(pose[:3, 3], t, atol=1e-8)
