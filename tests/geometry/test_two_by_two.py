"""Two-by-two matrices in closed form, against the library's factorisations."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry.two_by_two import determinants, mapped_back


def test_determinants():
    matrices = np.random.default_rng(2).normal(size=(5, 3, 2, 2))
    np.testing.assert_allclose(determinants(matrices), np.linalg.det(matrices), rtol=1e-9)


def test_vectors_are_mapped_back_as_by_solving():
    rng = np.random.default_rng(1)
    matrices, vectors = rng.normal(size=(7, 1, 2, 2)), rng.normal(size=(7, 3, 2))
    solved = np.linalg.solve(matrices, vectors[..., None])[..., 0]
    np.testing.assert_allclose(mapped_back(matrices, vectors), solved, rtol=1e-9)
