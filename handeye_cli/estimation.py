"""From the stations of a chain to an estimate of the answer by one method."""

from __future__ import annotations

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import Chain, has_pixels
from handeye_cli.errors import ConvergenceError, UsageError
from handeye_cli.estimates import Estimate
from handeye_cli.geometry import star
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.motion_check import check_agreement, check_distances
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.records import FloatArray, IntArray, Stations
from handeye_cli.solvers import Problem, Solution

PAIRS = {"star": star.star_pairs, "all": star.all_pairs}
"""Ways to choose interstation pairs."""
_ROUNDS = 30
_SETTLED = 1e-3
"""Change of the noise, in its own standard deviations, at which noise and answer agree."""


def choose_pairs(name: str, count: int) -> IntArray:
    """Return the (m, 2) interstation pairs of `count` stations.

    Raises:
        UsageError: There is no such way to choose them.
    """
    if name not in PAIRS:
        raise UsageError(f"expected --pairs {' or '.join(PAIRS)}, found {name!r}")
    return PAIRS[name](count)


def best_estimate(chain: Chain, pairs: IntArray, stations: Stations, method: str) -> Estimate:
    """Estimate the answer from all that a document holds on a chain's stations.

    Maximum likelihood goes back to the pixels where there are any. Where the intrinsics come with a
    covariance as well, their error is part of the estimate's, by every method; so is an error that
    all robot poses share.

    Args:
        chain: The stations to use.
        pairs: (m, 2) their interstation pairs.
        stations: The document they are from.
        method: A row of the table of solvers.

    Raises:
        UsageError: Unknown method.
        UndeterminedError: The stations contradict each other.
        InputError: Pixels have no place on the target, or are not those of the station's pose.
        ConvergenceError: The estimation, the noise, or both together did not settle.
    """
    from_pixels = has_pixels(stations, chain)
    if from_pixels:
        from handeye_cli.pixel_data import with_intrinsics

        chain = with_intrinsics(stations, chain)
    problem, solution, model = estimate(chain, pairs, stations, method)
    if from_pixels and method == solvers.MAXIMUM_LIKELIHOOD:
        from handeye_cli import joint

        return joint.refine(stations, chain, solution, model)
    influence = solvers.load(method).influence(problem, solution)
    return _by_poses(chain, stations, solution, model, influence)


def _by_poses(
    chain: Chain,
    stations: Stations,
    solution: Solution,
    model: NoiseModel,
    influence: FloatArray,
) -> Estimate:
    caused = chain.caused(influence)
    return Estimate(
        solution=solution,
        residuals=loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals,
        model=model,
        influence=influence,
        shared=caused @ caused.T,
        with_causes=caused,
        causes=np.eye(caused.shape[1]),
        causes_influence=np.zeros((len(influence), caused.shape[1], 12)),
        camera=stations.camera,
    )


def estimate(
    chain: Chain, pairs: IntArray, stations: Stations, method: str
) -> tuple[Problem, Solution, NoiseModel]:
    """Solve and estimate the noise in turns until both agree.

    A closed form does not depend on the noise and settles at once.

    Args:
        chain: The stations to use.
        pairs: (m, 2) their interstation pairs.
        stations: The document they are from, for its setup and its given noise.
        method: A row of the table of solvers.

    Raises:
        UsageError: Unknown method.
        UndeterminedError: The stations contradict each other.
        ConvergenceError: The solver, the noise, or both together did not settle.
    """
    solver, start = solvers.load(method), solvers.load("tsai-lenz")
    covariance = np.broadcast_to(np.eye(12), (len(chain.A), 12, 12))
    solution = start.solve(Problem(chain.A, chain.B, pairs, covariance))
    check_distances(solution, stations.setup)
    check_agreement(chain, solution)
    model = noise_model(chain, stations.noise, solution)
    for _ in range(_ROUNDS):
        problem = Problem(chain.A, chain.B, pairs, model.covariance)
        solution = solver.solve(problem)
        if not solution.converged:
            raise ConvergenceError(
                f"the {method} estimation did not converge on {len(chain.A)} stations",
                hint="try --method tsai-lenz, and look at the residuals of the stations",
            )
        previous, model = model, noise_model(chain, stations.noise, solution, model.noise)
        change = model.variances - previous.variances
        if change @ model.information @ change <= _SETTLED**2:
            return problem, solution, model
    raise ConvergenceError(
        f"the noise levels did not settle in {_ROUNDS} rounds on {len(chain.A)} stations",
        hint="give them under 'noise' in the document",
    )
