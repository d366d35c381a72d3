"""The report of a calibration: the answer, how sure it is, and every station's part in it."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from handeye_cli.conventions import MM
from handeye_cli.geometry import rotations
from handeye_cli.lasting_causes import CODES, LASTING
from handeye_cli.records import (
    Calibration,
    CriticalFactors,
    FloatArray,
    Noise,
    PredictedError,
    Spread,
)
from handeye_cli.render.comparison import show_comparison
from handeye_cli.render.console import show_paragraph, show_table
from handeye_cli.render.residuals import show_residuals
from handeye_cli.render.text import NOTHING, count, fixed, mm, mrad, pixels, printable


def show_calibration(calibration: Calibration, console: Console) -> None:
    """Print a calibration."""
    setup = calibration.setup
    used = sum(station.used for station in calibration.stations)
    console.print(
        f"{setup.answer}: the camera in the frame of the {setup.mount} ({setup.value})",
        style="bold",
    )
    console.print(
        f"by {calibration.method} from {used} of {count(len(calibration.stations), 'station')}\n"
    )
    _show_pose(calibration.mount_T_camera.matrix, console)
    console.print("How far from the truth it is expected to be")
    _show_error(calibration.predicted_error, console)
    origin = "estimated from the residuals" if calibration.noise_estimated else "as given"
    console.print(f"Noise of one station, {origin}")
    _show_noise(calibration.noise, console)
    if calibration.factors is not None:
        console.print("What limits it")
        _show_factors(calibration.factors, console)
    if calibration.improvements:
        console.print("What would help, each on its own")
        _show_improvements(calibration, console)
    if calibration.comparison:
        console.print("All methods: apart from maximum likelihood, and at stations left out (RMS)")
        show_comparison(calibration.comparison, console)
    console.print("Residuals of the stations")
    show_residuals(calibration.stations, console)


def _show_pose(pose: FloatArray, console: Console) -> None:
    turn, place = pose[:3, :3], pose[:3, 3]
    rows = [
        ["translation", *fixed(place / MM, 3), "", "mm"],
        ["rotation vector", *fixed(np.degrees(rotations.log(turn)), 4), "", "deg"],
        ["quaternion", *fixed(rotations.quaternion_from_matrix(turn), 7), ""],
    ]
    show_table(console, ["", "x", "y", "z", "w", ""], rows, left=[0, 5])


def _show_error(error: PredictedError, console: Console) -> None:
    rows = [
        ["RMS", mrad(error.rotation), mm(error.translation)],
        ["95 % are within", mrad(error.rotation_95), mm(error.translation_95)],
    ]
    if error.paper is not None:
        paper = error.paper
        rows.append(["paper, RMS: eq. (29), (31)", mrad(paper.rotation), mm(paper.translation)])
        rows.append(
            ["paper, maximum: eq. (30), (33)", mrad(paper.rotation_max), mm(paper.translation_max)]
        )
    show_table(console, ["", "rotation\nmrad", "translation\nmm"], rows, left=[0])


def _show_noise(noise: Noise, console: Console) -> None:
    rows = [
        ["robot", mrad(noise.robot_rotation), mm(noise.robot_translation), NOTHING],
        [
            "camera",
            mrad(noise.camera_rotation),
            mm(noise.camera_translation),
            pixels(noise.pixel),
        ],
    ]
    headings = ["", "rotation\nmrad", "translation\nmm", "one coordinate\npx"]
    show_table(console, headings, rows, left=[0])


def _show_factors(factors: CriticalFactors, console: Console) -> None:
    rows = [
        ["angle between stations", *_spread(factors.interstation_angle, np.pi / 180), "deg"],
        ["angle between their axes", *_spread(factors.axes_angle, np.pi / 180), "deg"],
        ["camera to target", *_spread(factors.camera_distance, MM), "mm"],
        ["gripper to gripper", *_spread(factors.gripper_distance, MM), "mm"],
    ]
    show_table(console, ["", "median", "smallest", "largest", ""], rows, left=[0, 4])
    if factors.robot_share_rotation is not None and factors.robot_share_translation is not None:
        rotation = 100.0 * factors.robot_share_rotation
        translation = 100.0 * factors.robot_share_translation
        console.print(
            f"  of the mean square error the robot's noise makes {rotation:.0f} % in rotation,\n"
            f"  {translation:.0f} % in translation\n"
        )


def _spread(spread: Spread, unit: float) -> list[str]:
    values = np.array([spread.median, spread.smallest, spread.largest])
    return fixed(values / unit, 1)


def _show_improvements(calibration: Calibration, console: Console) -> None:
    now = calibration.predicted_error
    rows = [["RMS as it is", mrad(now.rotation), mm(now.translation)]]
    rows += [
        [each.action, mrad(each.rotation), mm(each.translation)]
        for each in calibration.improvements
    ]
    show_table(console, ["", "rotation\nmrad", "translation\nmm"], rows, left=[0])
    _show_lasting(calibration, console)


def _show_lasting(calibration: Calibration, console: Console) -> None:
    """Print what none of the steps changes, and what the findings that tell of it advise."""
    told = [each.message for each in calibration.improvements if each.change == LASTING]
    if not told:
        return
    causes = [each for each in calibration.diagnosis if each.code in CODES]
    for line in (*told, *(f"{each.code}: {each.advice}" for each in causes)):
        show_paragraph(console, printable(line), margin="  ")
    console.print()
