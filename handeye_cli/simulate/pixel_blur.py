"""How the light of one pixel spreads over those around it: the integral of a Gaussian blur."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.records import FloatArray

CELLS = 4
"""Cells along each side of a pixel that an outline cuts."""


def blur_weights(blur_px: float, cells: int) -> FloatArray:
    """Return how much a lit cell adds to each pixel around the cell's own.

    Averaging the scene over cells and spreading it over them again widens the blur by a variance of
    a sixth of a squared cell, which the Gaussian therefore leaves out.

    Args:
        blur_px: Standard deviation of the Gaussian, pixels.
        cells: Number c of cells across a pixel.

    Returns:
        (2 m + 1, c) integrals over pixel and cell, of sum 1; m covers five standard deviations.
    """
    margin = math.ceil(5.0 * blur_px + 0.5)
    sigma = math.sqrt(max(0.0, blur_px**2 - 1.0 / (6.0 * cells**2)))
    edges = (np.arange(cells + 1) / cells - 0.5) - np.arange(-margin, margin + 1)[:, None]
    ramp = _blurred_ramp(edges + 0.5, sigma) - _blurred_ramp(edges - 0.5, sigma)
    return np.diff(ramp, axis=1)


def _blurred_ramp(x: FloatArray, sigma: float) -> FloatArray:
    """Return max(x, 0) after a Gaussian blur, the second integral of the Gaussian."""
    if sigma == 0.0:
        return np.maximum(x, 0.0)
    z = x / sigma
    below = np.array([0.5 * math.erfc(-each / math.sqrt(2.0)) for each in z.ravel()])
    density = np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return np.asarray(x * below.reshape(x.shape) + sigma * density)
