"""Every flag, once: frozen groups that the commands take and pass on whole."""

from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup

MOST_STATIONS = 10_000
"""Far more than a robot will visit; a larger number is a slip of the hand."""

_convention = partial(Flag, rich_help_panel="Conventions (a flag wins over the document)")
_robot = partial(
    Flag, rich_help_panel="MCAP recordings (no flag needed for what is unique in the file)"
)
_estimation = partial(Flag, rich_help_panel="Estimation")
_output = partial(Flag, rich_help_panel="Output")

TargetFlag = Annotated[
    str | None,
    _convention(
        metavar="SPEC", help="Target, such as chessboard:9x6:23.6mm or disc-grid:6x6:5mm:4mm."
    ),
]
SetupFlag = Annotated[
    Setup | None,
    _convention(metavar="WHERE", help="The camera is fixed eye-in-hand or eye-to-hand."),
]


class Pairs(StrEnum):
    """Which pairs of stations a closed form uses."""

    STAR = "star"
    ALL = "all"


@dataclass(frozen=True)
class Inputs:
    """What is read."""

    source: Annotated[
        str,
        Argument(
            metavar="INPUT",
            help="A recording (MCAP or document), or a document of an earlier stage; - is stdin.",
            show_default=False,
        ),
    ]
    further: Annotated[
        list[str] | None,
        Argument(
            metavar="FILE",
            help="More MCAP files of the same recording, in any order.",
            show_default=False,
        ),
    ] = None

    @property
    def paths(self) -> tuple[str, ...]:
        """All that was named as input, in that order."""
        return (self.source, *(self.further or ()))


@dataclass(frozen=True)
class Conventions:
    """How what is read is meant."""

    target: TargetFlag = None
    setup: SetupFlag = None
    pose_units: Annotated[
        PoseUnits | None, _convention(metavar="UNIT", help="Translations are in m or mm.")
    ] = None
    quaternion_order: Annotated[
        QuaternionOrder | None, _convention(metavar="ORDER", help="Quaternions are xyzw or wxyz.")
    ] = None
    robot_poses: Annotated[
        RobotPoses | None,
        _convention(
            metavar="WAY", help="Robot poses are given gripper-in-base or base-in-gripper."
        ),
    ] = None
    allow_outside: Annotated[
        bool,
        _convention("--allow-outside", help="Follow image paths out of the document's folder."),
    ] = False


@dataclass(frozen=True)
class Source(Conventions, Inputs):
    """What is read and how it is meant; `Inputs` is behind, so that its fields come first."""


@dataclass(frozen=True)
class Mcap:
    """What to take from a robot's recording."""

    image_topic: Annotated[str | None, _robot(metavar="TOPIC", help="Pictures.")] = None
    camera_info_topic: Annotated[str | None, _robot(metavar="TOPIC", help="Intrinsics.")] = None
    pose_topic: Annotated[
        str | None, _robot(metavar="TOPIC", help="Robot poses as PoseStamped.")
    ] = None
    base_frame: Annotated[
        str | None, _robot(metavar="FRAME", help="Base, for robot poses from TF.")
    ] = None
    gripper_frame: Annotated[
        str | None, _robot(metavar="FRAME", help="Gripper, for robot poses from TF.")
    ] = None
    time_offset: Annotated[
        str | None, _robot(metavar="TIME", help="Added to the images' times: 40ms, -12ms.")
    ] = None
    moving: Annotated[
        bool, _robot("--moving", help="Use frames in motion although the robot pauses.")
    ] = False


@dataclass(frozen=True)
class Work:
    """How the work is shared out; it changes nothing in the result."""

    workers: Annotated[
        int | None,
        _estimation(min=1, metavar="N", help="Processes for images; one per processor if not set."),
    ] = None


@dataclass(frozen=True)
class Pictures:
    """What is drawn to be looked at."""

    draw: Annotated[
        str | None,
        _output(
            "--draw", metavar="DIR", help="Write each image into DIR with what was found in it."
        ),
    ] = None


@dataclass(frozen=True)
class Intrinsics:
    """What is estimated about the camera itself."""

    calibrate_intrinsics: Annotated[
        bool,
        _estimation("--calibrate-intrinsics", help="Estimate the intrinsics from the same images."),
    ] = False


@dataclass(frozen=True)
class Solver:
    """How the camera's pose on its mount is estimated."""

    method: Annotated[
        str, _estimation(metavar="NAME", help="Solver; tsai-lenz is the paper's closed form.")
    ] = "maximum-likelihood"
    pairs: Annotated[Pairs, _estimation(help="Pairs of stations, for methods that use them.")] = (
        Pairs.STAR
    )


@dataclass(frozen=True)
class Methods:
    """What is told besides the whole answer by the method that is asked for."""

    compare: Annotated[
        bool,
        _estimation("--compare", help="List all methods side by side, with their errors held out."),
    ] = False
    partial: Annotated[
        bool,
        _estimation(
            "--partial",
            help="Where not all is determined, as of a SCARA robot, answer what is.",
        ),
    ] = False


@dataclass(frozen=True)
class Output:
    """Where the result goes and how much is said."""

    output: Annotated[
        str | None,
        _output(
            "--output",
            "-o",
            metavar="FILE",
            help="Write the document to FILE: YAML, or JSON when it ends in .json; - is stdout.",
        ),
    ] = None
    force: Annotated[bool, _output("--force", help="Replace files that exist.")] = False
    json: Annotated[bool, _output("--json", help="Print the document as JSON.")] = False
    quiet: Annotated[
        bool,
        _output("--quiet", "-q", help="No report, no progress; findings and errors remain."),
    ] = False
