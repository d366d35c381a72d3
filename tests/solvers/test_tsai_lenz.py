"""The closed form against the paper's equations written out, and in its exceptions."""

from __future__ import annotations

import numpy as np
import pytest
from principal_axes import matrix_from_principal_axis
from scenes import disturbed, joint_covariance, problem, scene

from handeye_cli.geometry import rotations, se3, star
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.records import Noise
from handeye_cli.solvers import Problem, tsai_lenz

PAPER_NOISE = Noise(1.5e-3, 5 * 25.4e-6, 1.5e-3, 3 * 25.4e-6)


def axis_of(R):
    """Eq. (9) by the matrix' own eigenvector, independent of quaternions."""
    values, vectors = np.linalg.eig(R)
    n = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    lower = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    n = n if n @ lower >= 0 else -n
    return 2.0 * np.sin(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)) / 2) * n


def as_printed(A, B, pairs):
    """Eq. (12), (14), (10) and (15), pair by pair."""
    rows, right = [], []
    for i, j in pairs:
        Pg = axis_of((np.linalg.inv(A[j]) @ A[i])[:3, :3])
        Pc = axis_of((B[j] @ np.linalg.inv(B[i]))[:3, :3])
        s = Pg + Pc
        rows.append([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
        right.append(Pc - Pg)
    P_prime = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    P = 2 * P_prime / np.sqrt(1 + P_prime @ P_prime)
    R = matrix_from_principal_axis(P)
    rows, right = [], []
    for i, j in pairs:
        Hg, Hc = np.linalg.inv(A[j]) @ A[i], B[j] @ np.linalg.inv(B[i])
        rows.append(Hg[:3, :3] - np.eye(3))
        right.append(R @ Hc[:3, 3] - Hg[:3, 3])
    T = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    return se3.from_parts(R, T)


@pytest.mark.parametrize("choose", [star.star_pairs, star.all_pairs])
@pytest.mark.parametrize("count", [3, 4, 7, 10])
def test_noisy_stations_give_what_the_equations_give(count, choose):
    rng = np.random.default_rng(count)
    for _ in range(5):
        perfect = scene(rng, count, angle=rng.uniform(0.1, 2.0))
        joint = joint_covariance(count, PAPER_NOISE)
        A = disturbed(rng, perfect.A, joint[:, :6, :6])
        B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
        found = tsai_lenz.solve(Problem(A, B, choose(count), joint))
        np.testing.assert_allclose(found.X, as_printed(A, B, choose(count)), atol=1e-9)


def test_the_base_setting_of_the_simulations():
    """3.15 mrad and 27.1 mil at N = 3, over all directions that |T_cg| can have."""
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(40):
        at = problem(scene(rng, 3), PAPER_NOISE)
        A = disturbed(rng, at.A, at.covariance[:, :6, :6], 100)
        B = disturbed(rng, at.B, at.covariance[:, 6:, 6:], 100)
        found = tsai_lenz.solve(Problem(A, B, at.pairs, at.covariance))
        errors.append(se3.difference(found.X, tsai_lenz.solve(at).X))
    square = np.concatenate(errors) ** 2
    rotation = np.sqrt(np.mean(np.sum(square[:, 3:], axis=1)))
    translation = np.sqrt(np.mean(np.sum(square[:, :3], axis=1)))
    assert rotation == pytest.approx(3.15e-3, rel=0.1)
    assert translation == pytest.approx(27.1 * 25.4e-6, rel=0.1)


@pytest.mark.parametrize("angle", [0.3, 2.0, 2.5, np.pi - 1e-3, np.pi])
def test_noise_does_no_more_harm_near_pi_than_elsewhere(angle):
    rng = np.random.default_rng(17)
    perfect = scene(rng, 5, angle=angle)
    at = problem(perfect, PAPER_NOISE)
    A = disturbed(rng, perfect.A, at.covariance[:, :6, :6], 2000)
    B = disturbed(rng, perfect.B, at.covariance[:, 6:, 6:], 2000)
    found = tsai_lenz.solve(Problem(A, B, at.pairs, at.covariance))
    rotation = np.linalg.norm(se3.difference(found.X, perfect.X)[:, 3:], axis=1)
    assert 1.9e-3 < np.sqrt(np.mean(rotation**2)) < 2.9e-3
    assert np.max(rotation) < 9e-3


@pytest.mark.parametrize("choose", [star.star_pairs, star.all_pairs])
def test_interstation_half_turns(choose):
    """Tilts of 90 deg put opposite stations exactly a half turn apart: |P| = 2."""
    rng = np.random.default_rng(19)
    for _ in range(20):
        perfect = scene(rng, 4, tilt_deg=90.0)
        found = tsai_lenz.solve(problem(perfect, PAPER_NOISE, pairs=choose(4)))
        np.testing.assert_allclose(found.X, perfect.X, atol=1e-10)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_half_turns_between_all_stations(noise):
    """Rotations alone then fit four answers; the translations tell which is right."""
    rng = np.random.default_rng(23)
    turns = np.array([np.diag([1.0, 1, 1]), np.diag([1.0, -1, -1]), np.diag([-1.0, -1, 1])])
    for _ in range(20):
        base = scene(rng, 3)
        B = se3.from_parts(turns @ rotations.exp(rng.normal(size=3)), rng.normal(size=(3, 3)))
        A = base.Z @ se3.inverse(B) @ se3.inverse(base.X)
        covariance = np.tile(isotropic_covariance(noise, noise) + 1e-30 * np.eye(6), (3, 1, 1))
        A = disturbed(rng, A, covariance)
        found = tsai_lenz.solve(Problem(A, B, star.star_pairs(3), np.zeros((3, 12, 12))))
        assert rotations.angle(found.X[:3, :3].T @ base.X[:3, :3]) < 1e-9 + 5 * noise
