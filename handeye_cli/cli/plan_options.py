"""The flags of `handeye plan`, and what their texts mean."""

import math
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.options import MOST_STATIONS, SetupFlag, TargetFlag
from handeye_cli.conventions import MM, MRAD, parse_angle, parse_length
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.planning.options import Limits
    from handeye_cli.records import FloatArray, Noise

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
class Way:
    """How the robot goes there."""

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


def limits_of(flags: CellLimits) -> "Limits":
    """Return the limits that flags set.

    Raises:
        UsageError: A text is not what its flag takes.
    """
    from handeye_cli.planning.options import Limits

    return Limits(
        margin=flags.margin_px,
        depth=None if flags.depth is None else _depth(flags.depth),
        max_tilt=_angle("max-tilt", flags.max_tilt, 80.0),
        max_roll=_angle("max-roll", flags.max_roll, 180.0),
        box=None if flags.box is None else _box(flags.box),
        reach=None if flags.reach is None else _positive("reach", parse_length(flags.reach)),
        cone=None if flags.cone is None else _cone(flags.cone),
        avoid_axis=None if flags.avoid_axis is None else _axis(flags.avoid_axis),
        min_rotation=_angle("min-rotation", flags.min_rotation, 180.0),
    )


def noise_of(flags: Levels) -> "Noise":
    """Return the noise levels that flags state."""
    from handeye_cli.records import Noise

    def scaled(level: float | None, unit: float) -> float | None:
        return None if level is None else level * unit

    return Noise(
        scaled(flags.robot_rotation_mrad, MRAD),
        scaled(flags.robot_translation_mm, MM),
        scaled(flags.camera_rotation_mrad, MRAD),
        scaled(flags.camera_translation_mm, MM),
        flags.pixel_noise,
    )


def lever_of(flags: Levels) -> float:
    """Return the lever in metres.

    Raises:
        UsageError: It is no length, or negative.
    """
    length = parse_length(flags.lever)
    if length < 0.0:
        raise UsageError(f"expected --lever to be at least 0 mm, found {flags.lever}")
    return length


def _angle(flag: str, text: str | None, most: float) -> float | None:
    if text is None:
        return None
    angle = parse_angle(text)
    if not 0.0 <= angle <= math.radians(most) + 1e-12:
        raise UsageError(f"expected --{flag} to be 0 to {most:g} deg, found {text}")
    return angle


def _positive(flag: str, length: float) -> float:
    if length <= 0.0:
        raise UsageError(f"expected --{flag} to be above 0 mm, found {length / MM:g} mm")
    return length


def _depth(text: str) -> tuple[float, float]:
    words = text.split(",")
    if len(words) != 2:
        raise UsageError(
            f"expected --depth to be two lengths, found {text!r}", hint="write it as 150mm,250mm"
        )
    near, far = _lengths(words)
    if not 0.0 < near <= far:
        raise UsageError(
            f"expected --depth to rise from above 0, found {near / MM:g} to {far / MM:g} mm"
        )
    return near, far


def _lengths(words: list[str]) -> list[float]:
    """Return lengths of which each has a unit, or only the last one, which then holds for all."""
    unit = re.sub(r"^[^a-zA-Z]*", "", words[-1].strip())
    bare = re.compile(r"\s*[-+]?[\d.]+\s*")
    return [parse_length(word + unit if bare.fullmatch(word) else word) for word in words]


def _box(text: str) -> "FloatArray":
    import numpy as np

    words = text.split(",")
    if len(words) != 6:
        raise UsageError(
            f"expected --box to be six lengths, found {text!r}",
            hint="write it as x0,y0,z0,x1,y1,z1: 200,-300,100,800,300,600mm",
        )
    box = np.array(_lengths(words)).reshape(2, 3)
    if np.any(box[0] > box[1]):
        axis = "xyz"[int(np.argmax(box[0] > box[1]))]
        raise UsageError(
            f"expected --box to give the smaller {axis} first, found {text}",
            hint="first the corner with the smallest x, y and z, then that with the largest",
        )
    return box


def _cone(text: str) -> "FloatArray":
    import numpy as np

    words = text.split(",")
    numbers = words[:3]
    if len(words) != 4 or not all(re.fullmatch(r"\s*[-+]?\d*\.?\d+\s*", each) for each in numbers):
        raise UsageError(
            f"expected --cone to be a direction and an angle, found {text!r}",
            hint="write it as 0,0,-1,60deg: the gripper's z axis points down, within 60 degrees",
        )
    direction = [float(each) for each in numbers]
    if not any(direction):
        raise UsageError(f"expected --cone to have a direction, found {text}")
    return np.array([*direction, _angle("cone", words[3], 180.0)])


def _axis(text: str) -> tuple[int, float]:
    name, comma, angle = text.partition(",")
    if name not in ("x", "y", "z"):
        raise UsageError(
            f"expected --avoid-axis to be x, y or z, found {name!r}", hint="write it as x or x,5deg"
        )
    most = _angle("avoid-axis", angle if comma else "10deg", 180.0)
    return "xyz".index(name), most or 0.0
