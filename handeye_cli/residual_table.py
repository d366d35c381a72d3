"""How far every station of a document is from an answer."""

from __future__ import annotations

import numpy as np

from handeye_cli.examination import Examined
from handeye_cli.records import FloatArray, StationResidual, Stations


def residual_table(
    stations: Stations, examined: Examined, residuals: FloatArray
) -> tuple[StationResidual, ...]:
    """Return a row for every station of a document.

    Args:
        stations: The document.
        examined: Which of its stations were used, and why others were not.
        residuals: (N, 6) of those that were used.
    """
    rotation = np.linalg.norm(residuals[:, 3:], axis=1)
    translation = np.linalg.norm(residuals[:, :3], axis=1)
    rows = {int(index): row for row, index in enumerate(examined.chain.index)}
    return tuple(
        StationResidual(station.name, True, float(rotation[rows[i]]), float(translation[rows[i]]))
        if i in rows
        else StationResidual(station.name, False, reason=examined.reasons.get(i, station.reason))
        for i, station in enumerate(stations.stations)
    )
