"""The flags of `handeye plan`."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.options import MOST_STATIONS, SetupFlag, TargetFlag

_plan = partial(Flag, rich_help_panel="Stations")
_limit = partial(Flag, rich_help_panel="Limits of the cell")
_noise = partial(Flag, rich_help_panel="Noise (a calibration's, else the paper's, if not set)")
_output = partial(Flag, rich_help_panel="Output")


@dataclass(frozen=True)
class Layout:
    """The stations that are planned."""

    stations: Annotated[
        int,
        _plan(
            metavar="N", max=MOST_STATIONS, help="Stations to calibrate on, 3 or more; or to add."
        ),
    ]
    distance: Annotated[
        str, _plan(metavar="LENGTH", help="Camera to aim point: 170mm, 0.5m, 6.65in.")
    ] = "170mm"
    tilt: Annotated[
        str, _plan(metavar="ANGLE", help="Turn away from straight above the target: 30deg.")
    ] = "30deg"
    target: TargetFlag = None
    setup: SetupFlag = None
    calibration: Annotated[
        str | None,
        _plan(
            metavar="GUESS",
            help="A first calibration: robot poses are planned with it. Or the camera's pose on "
            "its mount: a file, or x,y,z,qx,qy,qz,qw.",
        ),
    ] = None
    base_T_target: Annotated[
        str | None,
        _plan(
            "--base-T-target",
            "--gripper-T-target",
            metavar="GUESS",
            help="The target's pose in the base (eye-to-hand: in the gripper): a file, or "
            "x,y,z,qx,qy,qz,qw.",
        ),
    ] = None
    verification: Annotated[
        int,
        _plan(metavar="N", min=0, max=MOST_STATIONS, help="Stations in between, to verify on."),
    ] = 0
    optimize: Annotated[
        bool, _plan("--optimize", help="Choose the stations that make the error smallest.")
    ] = False
    after: Annotated[
        str | None,
        _plan(metavar="FILE", help="Add stations to this recording or stations document."),
    ] = None


@dataclass(frozen=True)
class CellLimits:
    """What a real cell allows."""

    camera: Annotated[
        str | None,
        _limit(metavar="FILE", help="Intrinsics, as `solve` takes them: the target stays in view."),
    ] = None
    margin_px: Annotated[
        float | None,
        _limit(min=0.0, metavar="PX", help="Target to image border; 2 % of the width if not set."),
    ] = None
    depth: Annotated[
        str | None,
        _limit(metavar="NEAR,FAR", help="Of all target points along the axis: 150mm,250mm."),
    ] = None
    max_tilt: Annotated[
        str | None, _limit(metavar="ANGLE", help="Line of sight to the target's normal.")
    ] = None
    max_roll: Annotated[
        str | None, _limit(metavar="ANGLE", help="Turn about the camera's axis, either way.")
    ] = None
    box: Annotated[
        str | None,
        _limit(metavar="BOX", help="For the gripper in the base: x0,y0,z0,x1,y1,z1 and a unit."),
    ] = None
    reach: Annotated[
        str | None, _limit(metavar="LENGTH", help="Base to gripper at most: 850mm.")
    ] = None
    cone: Annotated[
        str | None,
        _limit(metavar="X,Y,Z,ANGLE", help="Gripper's z axis about a base direction: 0,0,-1,60deg"),
    ] = None
    avoid_axis: Annotated[
        str | None,
        _limit(metavar="AXIS[,ANGLE]", help="No turns about a base axis beyond 10deg: x, y or z."),
    ] = None
    min_rotation: Annotated[
        str | None,
        _limit(metavar="ANGLE", help="Of the gripper between any two stations at least."),
    ] = None


@dataclass(frozen=True)
class Levels:
    """The noise a plan is predicted with."""

    robot_rotation_mrad: Annotated[
        float | None, _noise(min=0.0, metavar="MRAD", help="Robot poses, RMS angle.")
    ] = None
    robot_translation_mm: Annotated[
        float | None, _noise(min=0.0, metavar="MM", help="Robot poses, RMS distance.")
    ] = None
    camera_rotation_mrad: Annotated[
        float | None, _noise(min=0.0, metavar="MRAD", help="Target poses, RMS angle.")
    ] = None
    camera_translation_mm: Annotated[
        float | None, _noise(min=0.0, metavar="MM", help="Target poses, RMS distance.")
    ] = None
    pixel_noise: Annotated[
        float | None,
        _noise(min=0.0, metavar="PX", help="Of a coordinate; needs --target and intrinsics."),
    ] = None
    lever: Annotated[
        str,
        _noise(metavar="LENGTH", help="Gripper to camera (eye-to-hand: target), without a guess."),
    ] = "9.5in"


@dataclass(frozen=True)
class Journey:
    """The order of the stations, and files that the robot's program reads."""

    shortest_way: Annotated[
        bool, _output("--shortest-way", help="Add the order of stations with the least motion.")
    ] = False
    csv: Annotated[
        str | None, _output(metavar="FILE", help="Write the poses as a table: name, x, ..., qw.")
    ] = None
    mcap: Annotated[
        str | None, _output(metavar="FILE", help="Write them as a ROS 2 PoseArray in an MCAP file.")
    ] = None
    plot: Annotated[
        str | None,
        _output(metavar="FILE.png", help="Draw where the camera goes, and how it is turned there."),
    ] = None
