"""The flags of `handeye simulate`; their defaults are the base setting of the paper."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.options import Pairs

_setting = partial(Flag, rich_help_panel="Setting (the paper's, if not set)")
_noise = partial(Flag, rich_help_panel="Noise of each station, RMS magnitude")
_study = partial(Flag, rich_help_panel="Study")


@dataclass(frozen=True)
class Experiment:
    """The stations, and how they are calibrated."""

    stations: Annotated[int, _setting(metavar="N", help="Stations on the circle, 3 to 1000.")] = 3
    distance: Annotated[
        str, _setting(metavar="LENGTH", help="Camera to target: 170mm, 6.65in.")
    ] = "6.65in"
    tilt: Annotated[
        str, _setting(metavar="ANGLE", help="Turn away from straight above the target.")
    ] = "30deg"
    lever: Annotated[
        str, _setting(metavar="LENGTH", help="Gripper to camera, in a new direction each time.")
    ] = "9.5in"
    method: Annotated[
        str, _setting(metavar="NAME", help="Solver; tsai-lenz is the paper's closed form.")
    ] = "tsai-lenz"
    pairs: Annotated[Pairs, _setting(help="Pairs of stations, for methods that use them.")] = (
        Pairs.STAR
    )


@dataclass(frozen=True)
class NoiseLevels:
    """How noisy the stations' poses are."""

    robot_rotation: Annotated[str, _noise(metavar="ANGLE", help="Of base_T_gripper.")] = "1.5mrad"
    robot_translation: Annotated[str, _noise(metavar="LENGTH", help="Of base_T_gripper.")] = "5mil"
    camera_rotation: Annotated[str, _noise(metavar="ANGLE", help="Of camera_T_target.")] = "1.5mrad"
    camera_translation: Annotated[str, _noise(metavar="LENGTH", help="Of camera_T_target.")] = (
        "3mil"
    )


@dataclass(frozen=True)
class Study:
    """How much is simulated."""

    trials: Annotated[int, _study(metavar="N", help="Calibrations in each setting.")] = 1000
    seed: Annotated[int, _study(metavar="N", help="Of all chance.")] = 0
    figure: Annotated[
        str | None,
        _study(metavar="8...13|all", help="A figure of the paper instead of a single setting."),
    ] = None


@dataclass(frozen=True)
class Plot:
    """What is drawn to be looked at."""

    plot: Annotated[
        str | None,
        Flag(
            metavar="FILE.png",
            help="Draw the figure; of --figure all FILE-08.png, FILE-09.png, ...",
            rich_help_panel="Output",
        ),
    ] = None
