"""The poses of a plan as a table."""

import csv
import io

import numpy as np
import pytest
from planning.rigs import X, Z

from handeye_cli.geometry import rotations
from handeye_cli.plan import plan
from handeye_cli.planning import table
from handeye_cli.planning.options import PlanOptions


@pytest.mark.parametrize("known", [True, False])
def test_rows_are_the_poses_in_the_order_of_the_way(known):
    guesses = {"mount_T_camera": X, "reference_T_target": Z} if known else {}
    planned = plan(6, verification=2, options=PlanOptions(shortest_way=True), **guesses)
    assert sorted(planned.order) == [station.name for station in planned.stations]
    assert table.frames_of(planned) == (("base", "gripper") if known else ("target", "camera"))
    rows = list(csv.DictReader(io.StringIO(table.csv_text(planned))))
    assert [row["name"] for row in rows] == list(planned.order)
    by_name = {station.name: station for station in planned.stations}
    for row in rows:
        station = by_name[row["name"]]
        pose = station.base_T_gripper if known else station.target_T_camera
        place = [float(row[key]) for key in ("x", "y", "z")]
        np.testing.assert_array_equal(place, pose[:3, 3])
        turn = rotations.matrix_from_quaternion([float(row[f"q{k}"]) for k in "xyzw"])
        assert turn == pytest.approx(pose[:3, :3], abs=1e-14)


def test_without_a_way_the_order_is_the_plans():
    lines = table.csv_text(plan(3)).splitlines()
    assert lines[0] == "name,x,y,z,qx,qy,qz,qw"
    assert [line[:3] for line in lines[1:]] == ["00,", "01,", "02,"]
