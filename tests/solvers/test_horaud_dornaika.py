"""The rotation against the eigenvector of the paper's 4x4 matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, problem, scene
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import star
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, horaud_dornaika

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)


def left(p):
    """The matrix of `q -> p * q`, scalar first."""
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def right(p):
    """The matrix of `q -> q * p`."""
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])


def scalar_first(R):
    q = Rotation.from_matrix(R).as_quat(canonical=True)
    return np.array([q[3], *q[:3]])


def by_eigenvector(A, B, pairs):
    total = np.zeros((4, 4))
    for i, j in pairs:
        q_g = scalar_first(A[j, :3, :3].T @ A[i, :3, :3])
        q_c = scalar_first(B[j, :3, :3] @ B[i, :3, :3].T)
        apart = left(q_g) - right(q_c)
        total += apart.T @ apart
    w, x, y, z = np.linalg.eigh(total)[1][:, 0]
    return Rotation.from_quat([x, y, z, w]).as_matrix()


@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [3, 7, 10])
def test_noisy_stations_give_the_eigenvector(count, layout):
    rng = np.random.default_rng(count)
    for _ in range(5):
        at = problem(layout(rng, count), NOISE, pairs=star.all_pairs(count))
        A = disturbed(rng, at.A, at.covariance[:, :6, :6])
        B = disturbed(rng, at.B, at.covariance[:, 6:, 6:])
        found = horaud_dornaika.solve(Problem(A, B, at.pairs, at.covariance))
        np.testing.assert_allclose(found.X[:3, :3], by_eigenvector(A, B, at.pairs), atol=1e-9)
