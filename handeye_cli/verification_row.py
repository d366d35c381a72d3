"""A row of a verification: what was seen at the stations held out, beside what was predicted."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.held_out import HeldOutErrors, HeldOutPrediction
from handeye_cli.held_out_pixels import PixelErrors
from handeye_cli.records import FloatArray, StationError, Stations, VerificationRow


def row_of(
    stations: Stations,
    held_out: Chain,
    errors: HeldOutErrors,
    seen: PixelErrors,
    *,
    count: int,
    prediction: HeldOutPrediction | None,
) -> VerificationRow:
    """Return the row of some held-out stations.

    Args:
        stations: The document they are from.
        held_out: Their chain.
        errors: Their errors.
        seen: Their errors in the image and on the plate.
        count: Stations calibrated on.
        prediction: What is expected of the errors, or None when that is unknown.
    """
    columns = (errors.rotation, errors.translation, seen.reprojection, seen.plate)
    entries = tuple(
        StationError(
            stations.stations[index].name, rotation, translation, _known(pixels), _known(plate)
        )
        for index, rotation, translation, pixels, plate in zip(
            held_out.index.tolist(), *(column.tolist() for column in columns), strict=True
        )
    )
    return VerificationRow(
        stations=count,
        rotation=_rms(errors.rotation),
        translation=_rms(errors.translation),
        predicted_rotation=None if prediction is None else prediction.rotation,
        predicted_translation=None if prediction is None else prediction.translation,
        consistent=None if prediction is None else prediction.consistent,
        errors=entries,
        reprojection=_known(_rms(seen.reprojection)),
        plate=_known(_rms(seen.plate)),
    )


def _rms(values: FloatArray) -> float:
    """Return the RMS of the values that are numbers, NaN where none is."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else math.nan


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
