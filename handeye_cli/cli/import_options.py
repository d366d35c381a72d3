"""The flags of `handeye import`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.cli.options import Conventions

_foreign = partial(Flag, rich_help_panel="Data of another tool")


@dataclass(frozen=True)
class ForeignInput:
    """What is read: one file or folder."""

    source: Annotated[
        str,
        Argument(
            metavar="PATH", help="A file or folder of another tool's data.", show_default=False
        ),
    ]


@dataclass(frozen=True)
class ForeignSource(Conventions, ForeignInput):
    """What is read and how it is meant; the flags are those of every other command."""


@dataclass(frozen=True)
class ForeignKind:
    """What another tool's data are, where they do not tell it themselves."""

    kind: Annotated[
        str | None,
        _foreign(
            "--from",
            metavar="KIND",
            help="easy-handeye, moveit, industrial-calibration, visp, opencv or trajectory, where "
            "it cannot be told from the file.",
        ),
    ] = None
    images: Annotated[
        str | None,
        _foreign(metavar="DIR", help="Folder of the images that belong to a table of poses."),
    ] = None
    rotation: Annotated[
        str | None,
        _foreign(
            metavar="FORM",
            help="What rx, ry, rz of a table are: rotvec, or Euler axes such as xyz or ZYX:deg.",
        ),
    ] = None
    no_camera: Annotated[
        bool,
        _foreign(
            "--no-camera",
            help="Leave the intrinsics out, for solve --calibrate-intrinsics to estimate.",
        ),
    ] = False
