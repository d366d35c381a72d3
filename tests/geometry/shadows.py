"""Edges of shadows over a plate of seven by seven discs."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry.shadow_edge import ShadowEdge

MIDDLE, PITCH = np.array([310.0, 250.0]), 30.0
COLUMN, ROW = np.meshgrid(np.arange(-3, 4), np.arange(-3, 4))
PLACES = MIDDLE + PITCH * np.stack([COLUMN.ravel(), ROW.ravel()], axis=1)


def edge(direction=0.7, offset=0.2, width=0.6, depth=0.4, moments=(0.0, 0.0)):
    return ShadowEdge(MIDDLE, PITCH, np.array([direction, offset, np.log(width), depth, *moments]))
