"""A pose stated in words or in a small file."""

import json

import numpy as np
import pytest

from handeye_cli.documents.pose_guess import read_pose_guess
from handeye_cli.errors import InputError, UsageError


def test_seven_numbers():
    pose = read_pose_guess("0.1, -2e-1,.3,0,0,0.7071067811865476,0.7071067811865476")
    assert pose[:3, 3] == pytest.approx([0.1, -0.2, 0.3])
    assert pose[:3, :3] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)


def test_a_file_with_a_pose(tmp_path):
    path = tmp_path / "guess.yaml"
    path.write_text("translation: [1, 2, 3]\neuler: [0, 0, 90]\norder: xyz\ndegrees: true\n")
    assert read_pose_guess(str(path))[:3, 0] == pytest.approx([0, 1, 0], abs=1e-12)
    other = tmp_path / "guess.json"
    other.write_text(json.dumps({"matrix": np.eye(4).tolist()}))
    assert read_pose_guess(str(other)) == pytest.approx(np.eye(4))


def test_a_document_is_left_to_its_own_reader(tmp_path):
    path = tmp_path / "calibration.yaml"
    path.write_text("schema: handeye/calibration/1\n")
    assert read_pose_guess(str(path)) is None


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("1,2,3", UsageError, "seven numbers, found 3: 1,2,3"),
        ("0,0,0,0,0,0,2", InputError, "found the norm 2"),
        ("nowhere.yaml", InputError, "No such file"),
    ],
)
def test_what_is_no_pose(text, error, message):
    with pytest.raises(error, match=message):
        read_pose_guess(text)


def test_a_file_that_holds_something_else(tmp_path):
    path = tmp_path / "guess.yaml"
    path.write_text("translation: [1, 2, 3]\nquaternoin: [0, 0, 0, 1]\n")
    with pytest.raises(InputError, match="quaternoin") as caught:
        read_pose_guess(str(path))
    assert "quaternion" in caught.value.hint
