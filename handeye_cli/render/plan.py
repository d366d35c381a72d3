"""The report of a plan: where to go, what it will give, and what it was compared with."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from handeye_cli.conventions import MM, Setup
from handeye_cli.geometry import rotations, station_generator
from handeye_cli.records import FloatArray, Plan
from handeye_cli.records.planning import PlanBasis
from handeye_cli.render.console import show_table
from handeye_cli.render.text import count, deg, fixed, mm, mrad

_SOURCES = {
    "given": "as given",
    "calibration": "of the calibration",
    "recording": "of the recording",
    "paper": "the paper's",
    "pixels": "from the pixels",
}


def show_plan(plan: Plan, console: Console) -> None:
    """Print the stations, the robot's poses where they are known, pairs and predicted error."""
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
    _show_order(plan, console)
    _show_moved(plan, console)
    _show_gains(plan, console)
    _show_error(plan, console)


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


def _show_order(plan: Plan, console: Console) -> None:
    if plan.order:
        console.print("Shortest way")
        console.print(f"  {' '.join(plan.order)}\n")


def _show_moved(plan: Plan, console: Console) -> None:
    if not plan.moved:
        return
    console.print("Moved to the nearest allowed place")
    rows = [
        [each.name, deg(each.rotation), *fixed(np.array([each.translation / MM]), 1),
         ", ".join(each.limits)]
        for each in plan.moved
    ]  # fmt: skip
    show_table(console, ["station", "by\ndeg", "\nmm", "what it broke"], rows, left=[0, 3])


def _show_gains(plan: Plan, console: Console) -> None:
    if not plan.gains:
        return
    console.print("What each station gains, after those before it (RMS)")
    rows = [
        [
            each.name,
            f"{mrad(each.rotation_before)} -> {mrad(each.rotation)}",
            f"{mm(each.translation_before)} -> {mm(each.translation)}",
        ]
        for each in plan.gains
    ]
    show_table(console, ["station", "rotation\nmrad", "translation\nmm"], rows, left=[0])


def _show_error(plan: Plan, console: Console) -> None:
    if plan.predicted_error is None:
        return
    error = plan.predicted_error
    console.print(f"Predicted error, RMS: {mrad(error.rotation)} mrad, {mm(error.translation)} mm")
    if plan.circle is not None:
        kept = "" if plan.circle.allowed else ", which breaks limits"
        console.print(
            f"  the paper's circle{kept}: {mrad(plan.circle.rotation)} mrad, "
            f"{mm(plan.circle.translation)} mm"
        )
    if plan.basis is not None:
        _show_basis(plan, plan.basis, console)


def _show_basis(plan: Plan, basis: PlanBasis, console: Console) -> None:
    robot, camera = _SOURCES[basis.robot], _SOURCES[basis.camera]
    both = f"robot and camera {robot}" if robot == camera else f"robot {robot}, camera {camera}"
    console.print(f"  noise: {both}")
    if basis.lever is not None:
        carried = "camera" if plan.setup is Setup.EYE_IN_HAND else "target"
        console.print(
            f"  {carried} {basis.lever / MM:.1f} mm from the gripper, averaged over directions"
        )
