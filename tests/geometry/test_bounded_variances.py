"""Variances within bounds: right on average, at the top of the likelihood, and quickly there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from handeye_cli.geometry import bounded_variances as module
from handeye_cli.geometry.bounded_variances import bounded_variances

SIZE = 60
NO_FLOOR = np.full(2, 1e-12)


def smooth(length):
    x = np.arange(SIZE)
    return np.exp(-0.5 * ((x[:, None] - x) / length) ** 2)


SHAPES = np.stack([smooth(8.0), np.eye(SIZE)])
KNOWN = 0.1 * np.diag(np.linspace(0.5, 1.5, SIZE))


def drawn(rng, variances):
    covariance = KNOWN + np.tensordot(variances, SHAPES, axes=1)
    return np.linalg.cholesky(covariance) @ rng.normal(size=SIZE)


def fitted(residuals, floor=NO_FLOOR, start=(1.0, 1.0), shapes=SHAPES, **options):
    return bounded_variances(
        residuals=residuals,
        known=KNOWN,
        shapes=shapes,
        start=np.array(start),
        floor=floor,
        **options,
    )


def cost(log_variances, residuals):
    covariance = KNOWN + np.tensordot(np.exp(log_variances), SHAPES, axes=1)
    return np.linalg.slogdet(covariance)[1] + residuals @ np.linalg.solve(covariance, residuals)


@pytest.mark.parametrize("start", [(1.0, 1.0), (1e-3, 1e-3), (1e2, 1e-2)])
def test_they_are_those_of_a_general_optimiser(start):
    rng = np.random.default_rng(1)
    for _ in range(5):
        residuals = drawn(rng, [2.0, 0.5])
        best = minimize(cost, np.zeros(2), args=(residuals,), method="Nelder-Mead")
        found = fitted(residuals, start=start, gain=1e-9)
        assert cost(np.log(found), residuals) <= best.fun + 1e-6
        assert np.allclose(np.log(found), best.x, atol=1e-2)


def test_they_scatter_about_the_truth():
    rng = np.random.default_rng(3)
    found = np.array([fitted(drawn(rng, [2.0, 0.5])) for _ in range(100)])
    # 60 numbers: the white part to a fifth each time, the smooth part of few waves to two thirds
    assert np.mean(found[:, 1]) == pytest.approx(0.5, abs=3 * 0.2 * 0.5 / 10)
    assert np.mean(found[:, 0]) == pytest.approx(2.0, abs=3 * 0.7 * 2.0 / 10)


def test_none_falls_below_its_floor_and_the_others_are_the_best_then():
    rng = np.random.default_rng(5)
    floor, at_floor = np.array([1e-3, 1e-3]), 0
    for _ in range(20):
        residuals = drawn(rng, [0.0, 0.5])
        found = fitted(residuals, floor, gain=1e-9)
        assert np.all(found >= floor)
        if found[0] == floor[0]:
            at_floor += 1
            best = minimize(
                lambda v, r=residuals: cost(np.array([np.log(floor[0]), v[0]]), r),
                [0.0],
                method="Nelder-Mead",
            )
            assert np.log(found[1]) == pytest.approx(best.x[0], abs=1e-2)
    assert at_floor > 3


def test_few_looks_at_the_likelihood_are_enough(monkeypatch):
    """Each costs a matrix inversion; scoring on logarithms took a hundred at times."""
    looks = []
    state = module._state
    monkeypatch.setattr(module, "_state", lambda *each: looks.append(1) or state(*each))
    rng = np.random.default_rng(7)
    for variances in ([2.0, 0.5], [0.0, 0.5], [2.0, 0.0], [0.0, 0.0]):
        looks.clear()
        fitted(drawn(rng, variances), np.full(2, 1e-4))
        assert len(looks) < 15


def test_likenesses_of_equal_shapes_are_no_trouble():
    """Of two equal shapes only the sum is told."""
    rng = np.random.default_rng(9)
    residuals = drawn(rng, [2.0, 0.5])
    twice = np.stack([SHAPES[0], SHAPES[0] + 1e-9 * SHAPES[1], SHAPES[1]])
    found = fitted(residuals, np.full(3, 1e-6), (1.0, 1.0, 1.0), twice, gain=1e-9)
    alone = fitted(residuals, gain=1e-9)
    assert found[:2].sum() == pytest.approx(alone[0], rel=1e-2)
    assert found[2] == pytest.approx(alone[1], rel=1e-2)
