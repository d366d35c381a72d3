"""The estimate against an optimum found another way, and against the bound."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, scene
from scipy.optimize import least_squares

from handeye_cli.geometry import se3, star
from handeye_cli.solvers import Problem, maximum_likelihood, tsai_lenz


def anisotropic(rng, count):
    """Robot noise of 1 mrad and 0.2 mm, camera noise with depth and tilt far above the rest."""
    joint = np.zeros((count, 12, 12))
    joint[:, :6, :6] = np.diag(np.repeat([0.2e-3, 1e-3], 3) ** 2 / 3)
    sigma = np.array([2e-5, 2e-5, 4e-4, 2e-3, 2e-3, 2e-4]) * rng.uniform(0.5, 2, (count, 1))
    joint[:, 6:, 6:] = sigma[:, :, None] * np.eye(6) * sigma[:, None, :]
    return joint


def full_optimum(A, B, joint, X, Z):
    """Minimise over X, Z and every true camera pose: the robot's then follows from the loop."""
    count = len(A)
    roots = np.linalg.cholesky(np.linalg.inv(joint))

    def cost(v):
        X_v, Z_v = se3.perturb(X, v[:6]), se3.perturb(Z, v[6:12])
        B_v = se3.perturb(B, v[12:].reshape(count, 6))
        A_v = Z_v @ se3.inverse(B_v) @ se3.inverse(X_v)
        apart = np.concatenate([se3.difference(A, A_v), se3.difference(B, B_v)], axis=1)
        return np.einsum("nji,nj->ni", roots, apart).ravel()

    best = least_squares(cost, np.zeros(12 + 6 * count), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return se3.perturb(X, best.x[:6]), se3.perturb(Z, best.x[6:12])


@pytest.mark.parametrize("count", [5, 8, 12])
@pytest.mark.parametrize("layout", [scene, general_scene])
def test_the_answer_is_the_full_optimum(layout, count):
    rng = np.random.default_rng(count)
    perfect = layout(rng, count)
    joint = anisotropic(rng, count)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
    problem = Problem(A, B, star.star_pairs(count), joint)
    found = maximum_likelihood.solve(problem)
    X, Z = full_optimum(A, B, joint, perfect.X, perfect.Z)
    K = maximum_likelihood.influence(problem, found)
    sigma = np.sqrt(np.diag(np.einsum("nij,njk,nlk->il", K, joint, K)))
    apart = np.concatenate([se3.difference(found.X, X), se3.difference(found.Z, Z)])
    assert np.all(np.abs(apart) < 0.1 * sigma)


def test_it_beats_the_closed_form_where_the_noise_is_anisotropic():
    rng = np.random.default_rng(3)
    perfect = scene(rng, 8)
    joint = anisotropic(rng, 8)
    A = disturbed(rng, perfect.A, joint[:, :6, :6], 1000)
    B = disturbed(rng, perfect.B, joint[:, 6:, 6:], 1000)
    problem = Problem(A, B, star.star_pairs(8), joint)
    rms = [
        np.sqrt(np.mean(se3.difference(solver.solve(problem).X, perfect.X)[:, :3] ** 2))
        for solver in (maximum_likelihood, tsai_lenz)
    ]
    assert rms[0] < 0.9 * rms[1]
