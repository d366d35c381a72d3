"""The dual quaternion against the paper's recipe, pair by pair, scalar parts first."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, problem, scene
from scipy.spatial.transform import Rotation

from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, daniilidis

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)


def cross_matrix(v):
    return np.cross(v, np.eye(3)).T


def vectors(H):
    """The vector parts of a motion's dual quaternion, whose scalar part is not negative."""
    *v, w = Rotation.from_matrix(H[:3, :3]).as_quat(canonical=True)
    return np.array(v), 0.5 * (w * H[:3, 3] + np.cross(H[:3, 3], v))


def as_published(A, B, pairs):
    rows = []
    for i, j in pairs:
        a, a_dual = vectors(np.linalg.inv(A[j]) @ A[i])
        b, b_dual = vectors(B[j] @ np.linalg.inv(B[i]))
        real = np.column_stack([a - b, cross_matrix(a + b)])
        dual = np.column_stack([a_dual - b_dual, cross_matrix(a_dual + b_dual)])
        rows += [np.hstack([real, np.zeros((3, 4))]), np.hstack([dual, real])]
    *_, p, q = np.linalg.svd(np.concatenate(rows))[2]
    u1, v1, u2, v2 = p[:4], p[4:], q[:4], q[4:]
    roots = np.real(np.roots([u1 @ v1, u1 @ v2 + u2 @ v1, u2 @ v2]))
    lengths = [s * s * u1 @ u1 + 2 * s * u1 @ u2 + u2 @ u2 for s in roots]
    s = roots[np.argmax(lengths)]
    unit = (s * p + q) / np.sqrt(max(lengths))
    w, v, w_dual, v_dual = unit[0], unit[1:4], unit[4], unit[5:]
    t = 2.0 * (w * v_dual - w_dual * v - np.cross(v_dual, v))
    return Rotation.from_quat([*v, w]).as_matrix(), t


@pytest.mark.parametrize("layout", [scene, general_scene])
@pytest.mark.parametrize("count", [3, 7, 10])
def test_noisy_stations_give_what_the_recipe_gives(count, layout):
    rng = np.random.default_rng(count)
    for _ in range(5):
        at = problem(layout(rng, count), NOISE)
        A = disturbed(rng, at.A, at.covariance[:, :6, :6])
        B = disturbed(rng, at.B, at.covariance[:, 6:, 6:])
        found = daniilidis.solve(Problem(A, B, at.pairs, at.covariance))
        R, t = as_published(A, B, at.pairs)
        np.testing.assert_allclose(found.X[:3, :3], R, atol=1e-8)
        np.testing.assert_allclose(found.X[:3, 3], t, atol=1e-8)
