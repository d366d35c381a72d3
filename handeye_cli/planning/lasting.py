"""What a recording has to say to those who add stations to it: what these will not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.conventions import MM, MRAD
from handeye_cli.diagnosis.lengths import LENGTHS_NOT_CHECKED
from handeye_cli.geometry import se3
from handeye_cli.lasting_causes import codes_of_lasting
from handeye_cli.planning.recorded import Recorded
from handeye_cli.records import Finding, PredictedError
from handeye_cli.wording import CALIBRATE_AGAIN

LASTING = "new-stations-not-enough"
"""Code of the finding that part of the error is taken to stay, however many stations are added."""
_SHARE = 0.1
"""Part of a mean square error from which on what lasts is worth a word."""
_MOST = 0.5
"""The same from which on it is a warning."""


def findings_of(recorded: Recorded, error: PredictedError, count: int) -> tuple[Finding, ...]:
    """Return the findings on a recording with next steps that whoever plans can take.

    Args:
        recorded: The recording.
        error: What is predicted with all new stations.
        count: Number of new stations.
    """
    said = tuple(_for_a_plan(each, count) for each in recorded.findings)
    last = _lasting(recorded, error)
    return said if last is None else (*said, last)


def _for_a_plan(finding: Finding, count: int) -> Finding:
    """Return the finding, its advice in whole commands where it was in flags of another one."""
    if finding.advice == CALIBRATE_AGAIN:
        advice = (
            "estimate the intrinsics first: 'handeye extrinsics RECORDING --calibrate-intrinsics "
            f"-o calibrated.yaml', then 'handeye plan --after calibrated.yaml --stations {count}'; "
            "or calibrate the camera again"
        )
        return replace(finding, advice=advice)
    if finding.code == LENGTHS_NOT_CHECKED:
        advice = (
            "let new stations stand at other distances, with --depth NEAR,FAR; or measure the "
            "target over its whole length"
        )
        return replace(finding, advice=advice)
    return finding


def _lasting(recorded: Recorded, error: PredictedError) -> Finding | None:
    """Return what new stations leave as it is, or None where it is next to nothing."""
    squares = se3.by_kind(np.diag(recorded.lasting))[::-1]
    total = np.square([error.rotation, error.translation])
    share = float(np.max(squares / total))
    if share < _SHARE:
        return None
    rotation, translation = np.sqrt(np.maximum(squares, 0.0)).tolist()  # rounding may be below 0
    codes = ", ".join(codes_of_lasting(recorded.findings))
    return Finding(
        LASTING,
        "warning" if share > _MOST else "info",
        f"of the error of {error.rotation / MRAD:.3g} mrad and {error.translation / MM:.3g} mm "
        f"with all new stations, {rotation / MRAD:.3g} mrad and {translation / MM:.3g} mm (as "
        f"parts of sums of squares) are no noise{f' ({codes})' if codes else ''}: they are taken "
        "to stay, whatever is added",
        "mend first what these findings tell of, and record anew" if codes else "",
    )
