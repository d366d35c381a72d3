"""Damped steps on a valley that undamped ones climb out of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from handeye_cli.geometry.descent import descended


@dataclass(frozen=True)
class Valley:
    """Rosenbrock's function: residuals 10 (y - x^2) and 1 - x."""

    at: np.ndarray

    @property
    def residuals(self):
        x, y = self.at
        return np.array([10 * (y - x * x), 1 - x])

    @property
    def cost(self):
        return float(np.sum(self.residuals**2))

    def stepped(self, damping):
        x, _ = self.at
        J = np.array([[-20 * x, 10.0], [-1.0, 0.0]])
        normal = J.T @ J
        normal += damping * np.diag(np.diag(normal))
        return Valley(self.at - np.linalg.solve(normal, J.T @ self.residuals))


@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -4.0), (0.0, 10.0)])
def test_the_lowest_point_is_found(start):
    found = descended(Valley(np.array(start)), most=100, enough=1e-12)
    np.testing.assert_allclose(found.at, [1.0, 1.0], atol=1e-5)


def test_no_step_makes_it_worse():
    # an undamped step from here leads to a cost a thousand times as high
    here = Valley(np.array([-1.2, 1.0]))
    assert here.stepped(0.0).cost > 1000 * here.cost / 24.2
    costs = [descended(here, most=most, enough=0.0).cost for most in range(12)]
    assert costs[0] == here.cost
    assert np.all(np.diff(costs) <= 0.0)


def test_it_stops_where_little_is_gained():
    near = descended(Valley(np.array([-1.2, 1.0])), most=100, enough=0.5)
    far = descended(Valley(np.array([-1.2, 1.0])), most=100, enough=1e-12)
    assert far.cost < near.cost < 24.2
