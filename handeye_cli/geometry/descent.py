"""Damped steps downhill (Levenberg 1944, Marquardt 1963) for what knows how to take one."""

from __future__ import annotations

from typing import Protocol, TypeVar

_FIRST_DAMPING, _FACTOR = 1e-3, 10.0


class Descending(Protocol):
    """A fit that can be made better."""

    @property
    def cost(self) -> float:
        """How badly it fits; not negative."""

    def stepped(self: Descender, damping: float) -> Descender:
        """Return the fit after a step whose normal equations are damped by so much."""


Descender = TypeVar("Descender", bound=Descending)


def descended(fit: Descender, *, most: int, enough: float) -> Descender:
    """Return the fit after some steps, each of which made it better.

    Args:
        fit: Where to start.
        most: Steps to try.
        enough: The last step makes the cost less by a smaller share than this.
    """
    damping = _FIRST_DAMPING
    for _ in range(most):
        ahead = fit.stepped(damping)
        gain = fit.cost - ahead.cost
        if gain > 0.0:
            fit, damping = ahead, damping / _FACTOR
        else:
            damping *= _FACTOR
        if 0.0 <= gain < enough * fit.cost:
            break
    return fit
