"""Variance components against a dense restricted likelihood over all residuals at once."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import minimize

from handeye_cli.geometry import variance
from handeye_cli.geometry.variance import estimate

STATIONS, SIZE, UNKNOWNS = 7, 4, 6
TRUTH = np.array([2.0, 0.3])
FLOOR = np.array([1e-12, 1e-12])


def model(seed: int = 1, stations: int = STATIONS):
    """Random design, known covariances and shapes; the shapes do not span the whole space."""
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(stations, SIZE, UNKNOWNS))
    root = 0.3 * rng.normal(size=(stations, SIZE, SIZE))
    factors = rng.normal(size=(2, stations, SIZE, 2))
    known = root @ np.swapaxes(root, -1, -2) + 0.05 * np.eye(SIZE)
    return design, known, factors @ np.swapaxes(factors, -1, -2)


def simulated(design, known, shapes, seed: int, trials: int) -> np.ndarray:
    """Residuals (trials, N, d) with the true variances, and a mean that must not matter."""
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(known + np.einsum("k,knij->nij", TRUTH, shapes))
    noise = np.einsum("nij,tnj->tni", root, rng.normal(size=(trials, *design.shape[:2])))
    return noise + np.einsum("nij,tj->tni", design, rng.normal(size=(trials, UNKNOWNS)))


class Dense:
    """The same likelihood as one big normal distribution, by the textbook's formulas."""

    def __init__(self, residuals, design, known, shapes):
        self.e = residuals.ravel()
        self.J = design.reshape(-1, design.shape[-1])
        self.C = block_diag(*known)
        self.V = [block_diag(*shape) for shape in shapes]

    def covariance(self, variances):
        return self.C + sum(v * V for v, V in zip(variances, self.V, strict=True))

    def projector(self, variances):
        W = np.linalg.inv(self.covariance(variances))
        WJ = W @ self.J
        return W - WJ @ np.linalg.solve(self.J.T @ WJ, WJ.T)

    def likelihood(self, variances):
        """Density of the residuals' components across the design, by an orthonormal basis."""
        across = np.linalg.svd(self.J)[0][:, np.linalg.matrix_rank(self.J) :]
        S = across.T @ self.covariance(variances) @ across
        z = across.T @ self.e
        return -0.5 * (np.linalg.slogdet(S)[1] + z @ np.linalg.solve(S, z))

    def information(self, variances):
        P = self.projector(variances)
        products = [P @ V for V in self.V]
        return 0.5 * np.array([[np.trace(a @ b) for b in products] for a in products])


@pytest.fixture
def case():
    design, known, shapes = model()
    residuals = simulated(design, known, shapes, 2, 1)[0]
    return residuals, design, known, shapes


POINTS = [np.array([2.0, 0.3]), np.array([0.1, 5.0]), np.array([1e-3, 1e-3])]


def test_likelihood_is_the_dense_one_up_to_a_constant(case):
    dense = Dense(*case)
    offsets = [variance._likelihood(*case, p)[0] - dense.likelihood(p) for p in POINTS]
    assert offsets == pytest.approx([offsets[0]] * len(POINTS), abs=1e-10)


@pytest.mark.parametrize("point", POINTS)
def test_score_is_the_slope_of_the_dense_likelihood(case, point):
    dense = Dense(*case)
    _, score, _ = variance._likelihood(*case, point)
    h = 1e-5 * point
    steps = np.diag(h)
    numeric = [
        (dense.likelihood(point + d) - dense.likelihood(point - d)) / (2 * d.sum()) for d in steps
    ]
    assert score == pytest.approx(numeric, rel=1e-6, abs=1e-6)


def test_likelihood_of_an_undetermined_mean_is_the_dense_one(case):
    residuals, design, known, shapes = case
    flat = design[..., :4] @ np.random.default_rng(3).normal(size=(4, UNKNOWNS))
    dense = Dense(residuals, flat, known, shapes)
    basis = variance._orthonormal(flat)
    assert basis.shape[-1] == 4
    values = [variance._likelihood(residuals, basis, known, shapes, p)[0] for p in POINTS]
    offsets = np.array(values) - [dense.likelihood(p) for p in POINTS]
    assert offsets == pytest.approx(np.full(len(POINTS), offsets[0]), abs=1e-8)


@pytest.mark.parametrize("point", POINTS)
def test_information_is_the_textbooks(case, point):
    _, _, information = variance._likelihood(*case, point)
    expected = Dense(*case).information(point)
    assert information == pytest.approx(expected, rel=1e-9)


def test_information_is_the_spread_of_the_score(case):
    _, design, known, shapes = case
    trials = 1500
    drawn = simulated(design, known, shapes, 3, trials)
    scores = np.array([variance._likelihood(e, design, known, shapes, TRUTH)[1] for e in drawn])
    information = variance._likelihood(drawn[0], design, known, shapes, TRUTH)[2]
    root = np.linalg.cholesky(np.linalg.inv(information))
    white = scores @ root
    assert white.mean(axis=0) == pytest.approx(np.zeros(2), abs=4 / np.sqrt(trials))
    # Quadratic forms have heavier tails than normals: fourth moment below 15 instead of 3.
    assert white.T @ white / trials == pytest.approx(np.eye(2), abs=4 * np.sqrt(14 / trials))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("start", [[1.0, 1.0], [1e-4, 30.0], [1e3, 1e-5]])
def test_estimate_reaches_the_dense_optimum(seed, start):
    design, known, shapes = model(seed, 12)
    residuals = simulated(design, known, shapes, 10 + seed, 1)[0]
    found = estimate(
        residuals=residuals,
        design=design,
        known=known,
        shapes=shapes,
        start=np.array(start),
        floor=FLOOR,
    )
    dense = Dense(residuals, design, known, shapes)
    best = minimize(
        lambda log_v: -dense.likelihood(np.exp(log_v)),
        np.log(TRUTH),
        method="Nelder-Mead",
        options={"xatol": 1e-8, "fatol": 1e-13, "maxiter": 2000},
    )
    assert found.converged
    assert dense.likelihood(found.variances) >= -best.fun - 1e-9
    # The iteration stops at a gain of 1e-12 of the likelihood; near the top that is 1e-5 in log v.
    assert found.variances == pytest.approx(np.exp(best.x), rel=1e-4)
    assert found.information == pytest.approx(dense.information(found.variances), rel=1e-9)


def test_estimate_is_unbiased_although_the_mean_was_fitted():
    design, known, shapes = model(7, 12)
    trials = 300
    drawn = simulated(design, known, shapes, 20, trials)
    found = np.array(
        [
            estimate(
                residuals=e,
                design=design,
                known=known,
                shapes=shapes,
                start=np.ones(2),
                floor=FLOOR,
            ).variances
            for e in drawn
        ]
    )
    error = found.std(axis=0, ddof=1) / np.sqrt(trials)
    assert np.all(np.abs(found.mean(axis=0) - TRUTH) < 4 * error)


def test_one_component_alone_is_the_usual_unbiased_variance():
    rng = np.random.default_rng(8)
    design = rng.normal(size=(9, 3, 5))
    residuals = rng.normal(size=(9, 3))
    flat, e = design.reshape(27, 5), residuals.ravel()
    left = e - flat @ np.linalg.lstsq(flat, e, rcond=None)[0]
    found = estimate(
        residuals=residuals,
        design=design,
        known=np.zeros((9, 3, 3)),
        shapes=np.broadcast_to(np.eye(3), (1, 9, 3, 3)),
        start=np.array([0.01]),
        floor=np.array([1e-12]),
    )
    # 27 numbers, 5 of them spent: chi-square with 22 degrees of freedom, variance 2 v^2 / 22.
    assert found.variances[0] == pytest.approx(left @ left / 22, rel=1e-6)
    assert found.information[0, 0] == pytest.approx(22 / (2 * found.variances[0] ** 2), rel=1e-6)


@pytest.mark.parametrize("known_level", [0.0, 1e-6])
def test_zero_residuals_end_at_the_floor(known_level):
    design, known, _ = model(9)
    shapes = np.broadcast_to(np.diag([1.0, 1, 0, 0]), (2, STATIONS, SIZE, SIZE)).copy()
    shapes[1] = np.diag([0.0, 0, 1, 1])
    floor = np.array([1e-18, 1e-18])
    found = estimate(
        residuals=np.zeros((STATIONS, SIZE)),
        design=design,
        known=known_level * known,
        shapes=shapes,
        start=np.array([1e-4, 1e-2]),
        floor=floor,
    )
    assert found.converged
    if known_level == 0.0:
        assert np.array_equal(found.variances, floor)
    else:
        assert np.all(found.variances < 1e-3 * known_level)


def test_a_start_below_the_floor_is_raised():
    design, known, shapes = model(11)
    found = estimate(
        residuals=np.zeros((STATIONS, SIZE)),
        design=design,
        known=known,
        shapes=shapes,
        start=np.zeros(2),
        floor=np.array([1e-3, 1e-4]),
    )
    assert found.variances == pytest.approx([1e-3, 1e-4], rel=1e-12)
