"""The report of a plan: where to go, and how well the stations are spread."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from handeye_cli.conventions import MM
from handeye_cli.geometry import rotations, station_generator
from handeye_cli.records import FloatArray, Plan
from handeye_cli.render.console import show_table
from handeye_cli.render.text import count, fixed, mm, mrad


def show_plan(plan: Plan, console: Console) -> None:
    """Print the stations, the robot's poses where they are known, and the pairs."""
    console.print(
        f"{count(len(plan.stations), 'station')} to visit ({plan.setup.value})", style="bold"
    )
    console.print("Camera in the target's frame: position, and where its axis points\n")
    rows = [
        [each.name, each.purpose, *_position(each.target_T_camera), *_axis(each.target_T_camera)]
        for each in plan.stations
    ]
    headings = ["station", "purpose", "x\nmm", "y\nmm", "z\nmm", "axis x", "axis y", "axis z"]
    show_table(console, headings, rows, left=[0, 1])
    _show_robot(plan, console)
    _show_pairs(plan, console)
    if plan.predicted_error is not None:
        error = plan.predicted_error
        console.print(
            f"Predicted error, RMS: {mrad(error.rotation)} mrad, {mm(error.translation)} mm"
        )


def _position(pose: FloatArray) -> list[str]:
    return fixed(pose[:3, 3] / MM, 1)


def _axis(pose: FloatArray) -> list[str]:
    return fixed(pose[:3, 2], 3)


def _show_robot(plan: Plan, console: Console) -> None:
    poses = [(each.name, each.base_T_gripper) for each in plan.stations]
    rows = [
        [name, *_position(pose), *fixed(np.degrees(rotations.log(pose[:3, :3])), 2)]
        for name, pose in poses
        if pose is not None
    ]
    if not rows:
        return
    console.print("base_T_gripper: position and rotation vector")
    headings = ["station", "x\nmm", "y\nmm", "z\nmm", "rx\ndeg", "ry\ndeg", "rz\ndeg"]
    show_table(console, headings, rows, left=[0])


def _show_pairs(plan: Plan, console: Console) -> None:
    if not plan.pairs:
        return
    cameras = np.stack([each.target_T_camera for each in plan.stations])
    angles = np.degrees(station_generator.interstation_angles(cameras, plan.pairs))
    names = [plan.stations[i].name + "-" + plan.stations[j].name for i, j in plan.pairs]
    console.print(
        f"Interstation angles of the {count(len(names), 'pair')}: "
        f"{angles.min():.2f} to {angles.max():.2f} deg"
    )
    console.print(f"  {' '.join(names)}\n")
