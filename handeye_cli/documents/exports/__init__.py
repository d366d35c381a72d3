"""The answer in the files and lines that other software reads; a format is a file and a row here.

The module of a format has one function, `text`, from a `NamedTransform` to all of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Protocol, cast

from handeye_cli.documents.exports.naming import at_mount, check_names, named
from handeye_cli.errors import UsageError, did_you_mean
from handeye_cli.records.named_transform import NamedTransform

_ROOM = "handeye_cli.documents.exports"


@dataclass(frozen=True)
class Format:
    """A row of the table of formats.

    Attributes:
        module: Where it is written.
        description: What it is, for people.
        suffix: Ending without which its reader does not find the file; empty where any will do.
        needs_names: Whether the file says what the two frames are called.
        needs_optical: Whether its reader takes the child for the optical frame.
    """

    module: str
    description: str
    suffix: str = ""
    needs_names: bool = True
    needs_optical: bool = False


FORMATS = {
    "static-transform-publisher": Format(
        f"{_ROOM}.static_transform_publisher", "command line for ROS 2"
    ),
    "ros2-launch": Format(f"{_ROOM}.ros2_launch", "launch file for ROS 2", ".py"),
    "urdf": Format(f"{_ROOM}.urdf", "fixed joint of a URDF"),
    "easy-handeye": Format(f"{_ROOM}.easy_handeye", "calibration of easy_handeye, ROS 1", ".yaml"),
    "easy-handeye2": Format(
        f"{_ROOM}.easy_handeye2", "calibration of easy_handeye2, ROS 2", ".calib"
    ),
    "moveit": Format(f"{_ROOM}.moveit", "launch file of MoveIt Calibration, ROS 1", ".launch"),
    "opencv": Format(f"{_ROOM}.opencv", "FileStorage of OpenCV", needs_names=False),
    "csv": Format(f"{_ROOM}.matrix_csv", "4x4 matrix in metres", needs_names=False),
    "kalibr": Format(
        f"{_ROOM}.kalibr", "camchain of Kalibr", needs_names=False, needs_optical=True
    ),
    "zivid": Format(
        f"{_ROOM}.zivid", "4x4 matrix of Zivid in mm", needs_names=False, needs_optical=True
    ),
}
"""Every format, by its name on the command line."""


class _Writer(Protocol):
    """What the module of a format offers."""

    def text(self, transform: NamedTransform) -> str: ...


def load(name: str) -> Format:
    """Return the row of a format.

    Raises:
        UsageError: There is none of this name.
    """
    if name not in FORMATS:
        near = did_you_mean(name, list(FORMATS))
        raise UsageError(
            f"expected a format out of {', '.join(FORMATS)}, found {name!r}",
            hint=f"did you mean {near}?" if near else None,
        )
    return FORMATS[name]


def check_mount(name: str, mount_frame: str | None) -> None:
    """Refuse the mount link of a camera in a format that is about its optical frame.

    Args:
        name: Name of the format.
        mount_frame: Name of the mount link, or None.

    Raises:
        UsageError: There is a mount link, and the format cannot hold it.
    """
    if load(name).needs_optical and mount_frame is not None:
        raise UsageError(
            f"expected the optical frame for {name}, whose reader sees through it, found the "
            f"mount link {mount_frame!r}",
            hint="leave --mount-frame and --mount-T-optical out",
        )


def check_ending(name: str, path: str) -> None:
    """Refuse a file that the reader of a format would not find.

    Args:
        name: Name of the format.
        path: Name of the file that is to be written.

    Raises:
        UsageError: Its ending is not the one that is looked for.
    """
    suffix = load(name).suffix
    if not path.endswith(suffix):
        raise UsageError(
            f"expected a name that ends in {suffix}, as its reader looks for, found {path!r}",
            hint=f"a {FORMATS[name].description} is found by this ending",
        )


def text(transform: NamedTransform, name: str) -> str:
    """Return the file of a format, ending with a line break.

    Args:
        transform: What is written; never changed.
        name: Name of the format.

    Raises:
        UsageError: There is no such format, or it cannot hold this transform.
    """
    check_mount(name, None if transform.optical else transform.child)
    return cast(_Writer, import_module(load(name).module)).text(transform)


__all__ = [
    "FORMATS",
    "Format",
    "at_mount",
    "check_ending",
    "check_mount",
    "check_names",
    "load",
    "named",
    "text",
]
