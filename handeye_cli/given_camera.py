"""A record with the camera of a file of its own, as a flag that wins over what it came with."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import Camera, Features, Recording


def image_size(record: Any) -> tuple[int, int] | None:
    """Return the width and height of a record's images, or None where nothing tells them.

    Of a recording it is that of the first image that can be read.

    Raises:
        UsageError: The record is of a later stage than the points in the images.
    """
    _refuse_later(record)
    if isinstance(record, Features):
        known = record.camera
        return record.image_size or (None if known is None else (known.width, known.height))
    for station in record.stations:
        with suppress(InputError):
            height, width = station.image.load().shape
            return width, height
    return None


def with_camera(record: Any, camera: Camera) -> Any:
    """Return a record with another camera; points of discs move to where it sees their centres.

    Raises:
        UsageError: What the record holds was found with its own camera and would not change.
    """
    _refuse_later(record)
    if isinstance(record, Features):
        from handeye_cli import targets
        from handeye_cli.extrinsics import recentred

        record = recentred(record, targets.build(record.target), camera)
    return replace(record, camera=camera)


def _refuse_later(record: Any) -> None:
    if not isinstance(record, Recording | Features):
        raise UsageError(
            f"--camera cannot act on a {type(record).__name__.lower()} document, whose poses of "
            "the target rest on its own intrinsics already",
            hint="give the recording or its features document",
        )
