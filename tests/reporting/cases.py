"""Cases of a report, made from pixels without drawing pictures."""

from __future__ import annotations

import functools

import numpy as np
from pictures import Shot, shoot

from handeye_cli import documents
from handeye_cli.conventions import Setup
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import se3
from handeye_cli.records import Calibration, Finding, Stations
from handeye_cli.records.verification import Protocol, StationError, Verification, VerificationRow
from handeye_cli.reporting.case import Case
from handeye_cli.solve import solve

COUNT = 8


@functools.cache
def shot(setup: Setup = Setup.EYE_IN_HAND) -> Shot:
    return shoot(np.random.default_rng(11), COUNT, setup=setup)


@functools.cache
def stations(setup: Setup = Setup.EYE_IN_HAND) -> Stations:
    return documents.as_written(extrinsics(shot(setup).features))


@functools.cache
def calibration(setup: Setup = Setup.EYE_IN_HAND) -> Calibration:
    return solve(stations(setup))


def case(setup: Setup = Setup.EYE_IN_HAND) -> Case:
    return Case(
        name="calibration.yaml",
        features=shot(setup).features,
        stations=stations(setup),
        calibration=calibration(setup),
    )


def target_in_base(setup: Setup) -> np.ndarray:
    """(N, 4, 4) base_T_target of every station, by multiplying poses out."""
    answer = calibration(setup)
    robot = np.stack([each.base_T_gripper for each in stations(setup).stations])
    if setup is Setup.EYE_TO_HAND:
        return robot @ answer.reference_T_target.matrix
    seen = np.stack([each.camera_T_target.matrix for each in stations(setup).stations])
    return robot @ answer.mount_T_camera.matrix @ seen


def verification(
    *, consistent: bool | None = True, rotation: float = 1e-3, count: int = 4
) -> Verification:
    errors = (StationError("00", rotation, 1e-4), StationError("<b>", 2 * rotation, 2e-4))
    row = VerificationRow(count, rotation, 1e-4, 1.1e-3, 1.2e-4, consistent, errors)
    return Verification(Setup.EYE_IN_HAND, "tsai-lenz", (row,))


def left_out() -> Verification:
    errors = tuple(StationError(f"{i:02d}", 1e-3 * i, 1e-4 * i) for i in range(COUNT))
    row = VerificationRow(COUNT - 1, 1e-3, 1e-4, 1.1e-3, 1.2e-4, True, errors)
    return Verification(Setup.EYE_IN_HAND, "tsai-lenz", (row,), protocol=Protocol.LEAVE_ONE_OUT)


def finding(severity: str, words: str) -> Finding:
    return Finding(f"code-{severity}", severity, words, "do something")


def points_of_cameras(lines: np.ndarray) -> np.ndarray:
    """(c, 3) where all rays of a camera's pyramid begin."""
    assert np.ptp(lines[:, :4, 0], axis=1).max() < 1e-12
    return lines[:, 0, 0]


def inverse(T: np.ndarray) -> np.ndarray:
    return se3.inverse(T)
