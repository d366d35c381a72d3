"""Solvers of the loop `A_i X B_i = Z`, one module each; a new one is a file and a row here.

A solver module has two functions, `solve` and `influence`, as the `Solver` protocol says.
"""

from __future__ import annotations

from importlib import import_module
from typing import Protocol, cast

from handeye_cli.errors import UsageError, did_you_mean
from handeye_cli.solvers.problem import FloatArray, Problem, Solution

MAXIMUM_LIKELIHOOD = "maximum-likelihood"
"""The method that weighs with the stations' noise, and goes back to pixels where there are any."""
DEFAULT = MAXIMUM_LIKELIHOOD

_TABLE = {
    "tsai-lenz": "handeye_cli.solvers.tsai_lenz",
    MAXIMUM_LIKELIHOOD: "handeye_cli.solvers.maximum_likelihood",
    "park-martin": "handeye_cli.solvers.park_martin",
    "horaud-dornaika": "handeye_cli.solvers.horaud_dornaika",
    "daniilidis": "handeye_cli.solvers.daniilidis",
    "andreff": "handeye_cli.solvers.andreff",
    "shah": "handeye_cli.solvers.shah",
    "li": "handeye_cli.solvers.li",
}


class Solver(Protocol):
    """What a solver module offers."""

    def solve(self, problem: Problem) -> Solution:
        """Return X and Z of a problem, batched over its leading axes."""

    def influence(self, problem: Problem, solution: Solution) -> FloatArray:
        """Return (N, 12, 12): how X and Z move with the perturbations of A_i and B_i.

        Rows are the perturbations of X and of Z, columns those of A_i and of B_i.
        """


def names() -> list[str]:
    """Return the names of all solvers."""
    return list(_TABLE)


def load(name: str) -> Solver:
    """Return the solver of a name.

    Raises:
        UsageError: There is none of this name.
    """
    if name not in _TABLE:
        near = did_you_mean(name, names())
        raise UsageError(
            f"expected a method out of {', '.join(names())}, found {name!r}",
            hint=f"did you mean {near}?" if near else None,
        )
    return cast(Solver, import_module(_TABLE[name]))


__all__ = ["DEFAULT", "MAXIMUM_LIKELIHOOD", "Problem", "Solution", "Solver", "load", "names"]
