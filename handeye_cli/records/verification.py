"""Verification: errors on stations that took no part in a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import Finding, ProvenanceStep


class Protocol(StrEnum):
    """How the verification stations were kept apart from the calibration."""

    SPLIT = "split"
    """The paper's: calibrate on stations 1 to N, verify on N+1 to 2N."""
    LEAVE_ONE_OUT = "leave-one-out"
    """Each station is predicted by a calibration on all others."""
    CALIBRATION = "calibration"
    """An existing calibration on new stations, the target left in place."""
    MOVED_TARGET = "calibration-moved-target"
    """The same, the target's own pose taken from the other new stations."""


@dataclass(frozen=True)
class StationError:
    """Error of the camera pose predicted for one verification station.

    Attributes:
        name: Name of the station.
        rotation: Radians.
        translation: Metres.
        reprojection: RMS distance between the target's points as predicted and as seen, pixels;
            None without pixels.
        plate: The same on the target's plane, where the lines of sight of what was seen meet it,
            metres.
    """

    name: str
    rotation: float
    translation: float
    reprojection: float | None = None
    plate: float | None = None


@dataclass(frozen=True)
class VerificationRow:
    """One line of the paper's table: calibrated on N stations, verified on others.

    Attributes:
        stations: N, the number of stations calibrated on.
        rotation: RMS rotation error over the verification stations, radians.
        translation: RMS distance error over them, metres.
        predicted_rotation: What the covariances predict for it, radians, or None.
        predicted_translation: The same, metres, or None.
        consistent: Whether seen and predicted agree within chance, or None when not judged.
        errors: Each verification station's own errors.
        reprojection: RMS of their errors in the image, pixels; None without pixels.
        plate: RMS of their errors on the target's plane, metres; None without pixels.
    """

    stations: int
    rotation: float
    translation: float
    predicted_rotation: float | None
    predicted_translation: float | None
    consistent: bool | None
    errors: tuple[StationError, ...]
    reprojection: float | None = None
    plate: float | None = None


@dataclass(frozen=True)
class Verification:
    """Held-out errors of a calibration, and how they were held out."""

    setup: Setup
    method: str
    rows: tuple[VerificationRow, ...]
    diagnosis: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
    protocol: Protocol = Protocol.SPLIT
