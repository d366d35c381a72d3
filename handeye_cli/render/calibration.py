"""The report of a calibration: the answer, how sure it is, and every station's part in it."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from handeye_cli.conventions import MM
from handeye_cli.geometry import rotations
from handeye_cli.records import Calibration, FloatArray, Noise, PredictedError
from handeye_cli.render.console import show_table
from handeye_cli.render.text import NOTHING, count, fixed, mm, mrad, pixels


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
    console.print("Residuals of the stations")
    _show_residuals(calibration, console)


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


def _show_residuals(calibration: Calibration, console: Console) -> None:
    rows = [
        [
            station.name,
            "yes" if station.used else "no",
            mrad(station.rotation),
            mm(station.translation),
            station.reason or "",
        ]
        for station in calibration.stations
    ]
    headings = ["station", "used", "rotation\nmrad", "translation\nmm", ""]
    show_table(console, headings, rows, left=[0, 1, 4])
