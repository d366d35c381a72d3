"""Flags of the commands that verify."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Flag

_protocol = partial(Flag, rich_help_panel="Protocol")


@dataclass(frozen=True)
class Protocol:
    """What a verification checks, and the limits it must keep."""

    stations: Annotated[
        str | None,
        _protocol(
            metavar="N,N,...",
            help="Calibrate on the first N stations, verify on the next N, for each N; "
            "half of all stations if not set.",
        ),
    ] = None
    leave_one_out: Annotated[
        bool,
        _protocol(
            "--leave-one-out",
            help="Predict each station by a calibration on all others, when there are few.",
        ),
    ] = False
    calibration: Annotated[
        str | None,
        _protocol(metavar="FILE", help="Check this calibration on all stations instead."),
    ] = None
    target_moved: Annotated[
        bool,
        _protocol(
            "--target-moved",
            help="The target was moved after the calibration: take its place from the stations.",
        ),
    ] = False
    max_rotation_mrad: Annotated[
        float | None, _protocol(min=0.0, metavar="MRAD", help="Exit 6 when a row is above it.")
    ] = None
    max_translation_mm: Annotated[
        float | None, _protocol(min=0.0, metavar="MM", help="Exit 6 when a row is above it.")
    ] = None
    strict: Annotated[
        bool, _protocol("--strict", help="Exit 6 when a row contradicts its prediction.")
    ] = False
