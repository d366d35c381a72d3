"""The flag for intrinsics that come from a file of their own, and what it does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.inputs import Opened, open_input
from handeye_cli.cli.options import Mcap, Source
from handeye_cli.errors import UsageError


@dataclass(frozen=True)
class CameraFile:
    """Where the intrinsics come from."""

    camera: Annotated[
        str | None,
        Flag(
            metavar="FILE",
            help="Intrinsics from a ROS or OpenCV calibration, a Kalibr camchain (FILE#cam1) or "
            "any document with a camera; they win over the input's.",
            rich_help_panel="Camera",
        ),
    ] = None


def open_inputs(source: Source, mcap: Mcap, camera_file: CameraFile) -> list[Opened]:
    """Read a command's input, and the intrinsics that win over its own.

    Returns:
        The input first, then the file of the intrinsics if one was named.

    Raises:
        InputError: One cannot be read or is not valid, or the two do not fit together.
        UsageError: A flag cannot act on this kind of input.
    """
    name = camera_file.camera
    if name is None:
        return [open_input(source, mcap)]
    check_intrinsics_flags(mcap, camera_file)
    return with_camera_file(open_input(source, mcap, own_intrinsics=True), name)


def check_intrinsics_flags(mcap: Mcap, camera_file: CameraFile) -> None:
    """Check that the intrinsics are not to come from two places.

    Raises:
        UsageError: They are.
    """
    if camera_file.camera is not None and mcap.camera_info_topic is not None:
        raise UsageError(
            "expected --camera or --camera-info-topic, found both", hint="leave one of them out"
        )


def with_camera_file(opened: Opened, name: str) -> list[Opened]:
    """Return an input with the intrinsics of a file, and that file.

    Args:
        opened: What was read without intrinsics of its own.
        name: The file.

    Raises:
        InputError: It cannot be read or is not valid, or the two do not fit together.
    """
    from handeye_cli import given_camera
    from handeye_cli.documents import cameras

    read = cameras.read(name, given_camera.image_size(opened.record))
    record = given_camera.with_camera(opened.record, read.camera)
    return [replace(opened, record=record), Opened(read.camera, (read.name, read.sha256))]
