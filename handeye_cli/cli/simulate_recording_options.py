"""The flags of `handeye simulate recording`; without any it is the paper's plate, seen in VGA."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.options import MOST_STATIONS
from handeye_cli.conventions import Setup

MOST_PIXELS = 10_000
"""Along each side of an image."""

_scene = partial(Flag, rich_help_panel="Scene")
_camera = partial(Flag, rich_help_panel="Camera")
_noise = partial(Flag, rich_help_panel="Light and noise (the robot's: RMS magnitude)")
_shooting = partial(Flag, rich_help_panel="MCAP (the robot goes from pause to pause)")
_output = partial(Flag, rich_help_panel="Output")


@dataclass(frozen=True)
class Scenery:
    """What is recorded, from where, and what goes wrong."""

    plan: Annotated[
        str | None, _scene(metavar="FILE", help="Stations of a plan; else those of `plan`:")
    ] = None
    stations: Annotated[
        int, _scene(metavar="N", max=MOST_STATIONS, help="Stations, 3 or more.")
    ] = 9
    distance: Annotated[
        str | None,
        _scene(metavar="LENGTH", help="Camera to target; fills 0.4 of the image if not set."),
    ] = None
    tilt: Annotated[
        str, _scene(metavar="ANGLE", help="Turn away from straight above the target.")
    ] = "30deg"
    target: Annotated[
        str | None, _scene(metavar="SPEC", help="As in `solve`; the paper's plate if not set.")
    ] = None
    setup: Annotated[
        Setup | None, _scene(metavar="WHERE", help="The camera is eye-in-hand or eye-to-hand.")
    ] = None
    calibration: Annotated[
        str | None,
        _scene(metavar="FILE", help="Where camera and target really are: this calibration."),
    ] = None
    fault: Annotated[
        list[str] | None,
        _scene(
            metavar="FAULT",
            help="What goes wrong; may be given again: moved-plate:5:20mm, swapped:3,7, "
            "dropped:2,5, time-offset:40ms, bowed:1.2mm, scaled:1.25, robot-scale:1.003.",
        ),
    ] = None


@dataclass(frozen=True)
class Optics:
    """The camera."""

    camera: Annotated[
        str | None,
        _camera(
            metavar="FILE", help="Intrinsics, from any file that `solve` takes them from; else:"
        ),
    ] = None
    width: Annotated[int, _camera(metavar="PX", min=16, max=MOST_PIXELS, help="Columns.")] = 640
    height: Annotated[int, _camera(metavar="PX", min=16, max=MOST_PIXELS, help="Rows.")] = 480
    focal_px: Annotated[float, _camera(metavar="PX", min=1.0, help="Focal length.")] = 550.0
    distortion: Annotated[
        str | None, _camera(metavar="K1,K2,P1,P2,K3", help="Of the lens, in OpenCV's order.")
    ] = None


@dataclass(frozen=True)
class Disturbance:
    """What light, lens and chance do."""

    robot_rotation: Annotated[
        str, _noise(metavar="ANGLE", help="Of the gripper, at each station.")
    ] = "0.2mrad"
    robot_translation: Annotated[
        str, _noise(metavar="LENGTH", help="Of the gripper, at each station.")
    ] = "0.05mm"
    image_noise: Annotated[
        float, _noise(metavar="LEVELS", min=0.0, max=255.0, help="Of a pixel, grey levels.")
    ] = 2.0
    blur_px: Annotated[
        float, _noise(metavar="PX", min=0.0, max=100.0, help="Of the lens, pixels.")
    ] = 0.7
    gradient: Annotated[
        str | None,
        _noise(
            metavar="RIGHT,DOWN",
            help="Uneven light: its relative change across the image and down it: 0.12,-0.08.",
        ),
    ] = None
    seed: Annotated[int, _noise(metavar="N", min=0, help="Of all chance.")] = 0


@dataclass(frozen=True)
class Camerawork:
    """How a robot's run is recorded."""

    rate: Annotated[
        float, _shooting(metavar="HZ", min=0.1, max=1000.0, help="Pictures, in motion too.")
    ] = 5.0
    pause: Annotated[str, _shooting(metavar="TIME", help="At each station.")] = "1s"
    tf_rate: Annotated[
        float, _shooting(metavar="HZ", min=0.1, max=10_000.0, help="Poses of the robot.")
    ] = 100.0
    raw: Annotated[
        bool, _shooting("--raw", help="Pictures as Image, not as CompressedImage in PNG.")
    ] = False


@dataclass(frozen=True)
class Made:
    """Where the recording goes, and its truth."""

    output: Annotated[
        str,
        _output(
            "--output",
            "-o",
            metavar="PATH",
            help="A folder for recording.yaml and its images, or a file that ends in .mcap.",
        ),
    ]
    truth: Annotated[
        str | None, _output(metavar="FILE", help="Write the true poses into FILE.")
    ] = None
    force: Annotated[bool, _output("--force", help="Replace files that exist.")] = False
    quiet: Annotated[bool, _output("--quiet", "-q", help="No progress; findings remain.")] = False
