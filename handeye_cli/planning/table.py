"""The poses of a plan as plain tables: rows for a CSV file, and in the order of the way."""

from __future__ import annotations

import csv
import io

import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations
from handeye_cli.records import FloatArray, Plan, PlannedStation

HEADINGS = ("name", "x", "y", "z", "qx", "qy", "qz", "qw")
"""Columns of the table: metres, and a unit quaternion."""


def in_order(plan: Plan) -> list[PlannedStation]:
    """Return the stations in the order of the plan's way, or as they stand where it has none."""
    by_name = {station.name: station for station in plan.stations}
    return [by_name[name] for name in plan.order or by_name]


def frames_of(plan: Plan) -> tuple[str, str]:
    """Return parent and child of the poses that are listed: the gripper's where it is known."""
    known = all(station.base_T_gripper is not None for station in plan.stations)
    return ("base", "gripper") if known else ("target", "camera")


def poses_of(plan: Plan) -> FloatArray:
    """Return (N, 7) positions and quaternions x y z w, in the order of the way.

    They are those of base_T_gripper or, where that is not known, of target_T_camera.

    Raises:
        UsageError: There is no station.
    """
    stations = in_order(plan)
    if not stations:
        raise UsageError("expected at least one station to list, found none")
    known = frames_of(plan)[0] == "base"
    poses = np.array([each.base_T_gripper if known else each.target_T_camera for each in stations])
    # adding zero turns -0.0 into 0.0
    quaternions = rotations.quaternion_from_matrix(poses[:, :3, :3])
    return np.concatenate([poses[:, :3, 3], quaternions], axis=1) + 0.0


def csv_text(plan: Plan) -> str:
    """Return the poses of a plan as a table with a heading, one station a line."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(HEADINGS)
    names = [station.name for station in in_order(plan)]
    writer.writerows([name, *row] for name, row in zip(names, poses_of(plan).tolist(), strict=True))
    return stream.getvalue()
