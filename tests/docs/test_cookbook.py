"""The ways in which robots write a pose, as the cookbook gives them, are one and the same pose."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli import read
from handeye_cli.errors import InputError

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "cookbook.md").read_text("utf-8")
DOCUMENTS = re.findall(r"^### (\w+).*?```yaml\n(.*?)```", PAGE, re.MULTILINE | re.DOTALL)

POSITION_M = (0.450, -0.1205, 0.38025)
A, B, C = 30.0, -20.0, 170.0
WRITTEN = 2e-6
"""Rounding of the numbers as they are written: six decimals of a radian or more."""


def _truth():
    about = [Rotation.from_rotvec(np.radians(angle) * np.eye(3)[axis])
             for angle, axis in ((A, 2), (B, 1), (C, 0))]  # fmt: skip
    truth = np.eye(4)
    # A about z, B about the new y, C about the newest x: each turn acts in the frame before it
    truth[:3, :3] = (about[0] * about[1] * about[2]).as_matrix()
    truth[:3, 3] = POSITION_M
    return truth


def _read(text, folder):
    path = folder / "stations.yaml"
    path.write_text(text, encoding="utf-8")
    (station,) = read(str(path)).stations
    return station


def test_every_robot_has_a_document():
    assert [name for name, _ in DOCUMENTS] == ["Universal", "Franka", "KUKA", "ABB"]


@pytest.mark.parametrize("text", [text for _, text in DOCUMENTS], ids=[n for n, _ in DOCUMENTS])
def test_each_way_of_writing_gives_the_same_pose(text, tmp_path):
    station = _read(text, tmp_path)
    assert station.base_T_gripper == pytest.approx(_truth(), abs=WRITTEN)
    assert station.camera_T_target.matrix[:3, 3] == pytest.approx([0.01, -0.02, 0.31], abs=1e-12)
    assert station.camera_T_target.matrix[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)


def test_numbers_column_by_column_become_the_matrix_of_the_page():
    O_T_EE = _truth().T.ravel()
    assert O_T_EE[12:15] == pytest.approx(POSITION_M)
    assert np.reshape(O_T_EE, (4, 4), order="F") == pytest.approx(_truth(), abs=0)


def test_a_matrix_column_by_column_is_refused(tmp_path):
    (text,) = [text for name, text in DOCUMENTS if name == "Franka"]
    rows = re.findall(r"- (\[.*\])", text)
    columns = np.array([[float(x) for x in row.strip("[]").split(",")] for row in rows]).T
    for row, column in zip(rows, columns.tolist(), strict=True):
        text = text.replace(f"- {row}", f"- {column}")
    with pytest.raises(InputError, match=r"\[0\.45, -0\.1205, 0\.38025, 1\.0\]"):
        _read(text, tmp_path)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("order: ZYX", "order: zyx"), ("quaternion_order: wxyz\n", ""), ("pose_units: mm\n", "")],
)
def test_each_word_of_the_page_is_needed(wrong, right, tmp_path):
    texts = [text for _, text in DOCUMENTS if wrong in text]
    assert texts
    for text in texts:
        pose = _read(text.replace(wrong, right), tmp_path).base_T_gripper
        assert np.max(np.abs(pose - _truth())) > 0.01
