"""The flags of `handeye export`."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Flag

_frames = partial(Flag, rich_help_panel="Frames")
_output = partial(Flag, rich_help_panel="Output")


@dataclass(frozen=True)
class Form:
    """What the answer is written as."""

    to: Annotated[
        str,
        _output(
            metavar="FORMAT",
            help="static-transform-publisher, ros2-launch, urdf, easy-handeye, easy-handeye2, "
            "moveit, opencv, csv, kalibr or zivid.",
        ),
    ]


@dataclass(frozen=True)
class Frames:
    """The names of the frames, and which frame of the camera is meant."""

    parent: Annotated[
        str | None,
        _frames(metavar="FRAME", help="The gripper's, such as tool0; eye-to-hand: the base's."),
    ] = None
    child: Annotated[
        str | None, _frames(metavar="FRAME", help="The optical frame of the camera.")
    ] = None
    mount_frame: Annotated[
        str | None,
        _frames(metavar="FRAME", help="Place this link of the camera instead: camera_link."),
    ] = None
    mount_T_optical: Annotated[
        str | None,
        _frames(
            "--mount-T-optical",
            metavar="POSE",
            help="The optical frame's pose in that link: a file, x,y,z,qx,qy,qz,qw, or an MCAP "
            "recording with TF; that of the INPUT if not set.",
        ),
    ] = None


@dataclass(frozen=True)
class Destination:
    """Where the text goes."""

    output: Annotated[
        str | None,
        _output("--output", "-o", metavar="FILE", help="Write to FILE; - is stdout."),
    ] = None
    force: Annotated[bool, _output("--force", help="Replace a file that exists.")] = False
    quiet: Annotated[
        bool, _output("--quiet", "-q", help="No progress; findings and errors remain.")
    ] = False
