"""Open a robot's recording once for both: what it holds, and what is calibrated from it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.camera_options import (
    CameraFile,
    check_intrinsics_flags,
    open_inputs,
    with_camera_file,
)
from handeye_cli.cli.inputs import Opened, open_looked
from handeye_cli.cli.options import Mcap, Source

if TYPE_CHECKING:
    from handeye_cli.records import Inspection


def open_both(
    source: Source, mcap: Mcap, camera_file: CameraFile, flags: dict[str, Any]
) -> tuple[list[Opened], Inspection | None]:
    """Return the input with the file of its intrinsics, and what it holds if it is a recording.

    Of a recording that cannot be read yet, the input is what it holds.

    Args:
        source: Flags about what is read.
        mcap: Flags about what is taken from a robot's recording.
        camera_file: Intrinsics that win over the input's.
        flags: All flags that were given.

    Raises:
        InputError: A file cannot be read or is not valid, or the two do not fit together.
        UsageError: A flag cannot act on this kind of input.
    """
    check_intrinsics_flags(mcap, camera_file)
    name = camera_file.camera
    looked = open_looked(source, mcap, flags, own_intrinsics=name is not None)
    if looked is None:
        return open_inputs(source, mcap, camera_file), None
    summary, recorded = looked.record.inspection, looked.record.recording
    opened = replace(looked, record=summary if recorded is None else recorded)
    if recorded is None or name is None:
        return [opened], summary
    return with_camera_file(opened, name), summary
