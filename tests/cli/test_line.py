"""The whole line, from the pictures of the sample recording to an answer near the truth."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from handeye_cli.geometry import rotations

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "paper-plate"
RECORDING = SAMPLE / "recording.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("line")


@pytest.fixture
def features_file(handeye, folder):
    """The features of the sample recording, extracted once for this file."""
    path = folder / "features.yaml"
    if not path.exists():
        done = handeye("extract", RECORDING, "-o", path, terminal=True)
        assert done.code == 0, done.err
        path.with_suffix(".report").write_text(done.out, encoding="utf-8")
    return path


def test_every_picture_shows_the_plate(features_file):
    document = yaml.safe_load(features_file.read_text())
    assert [len(station["pixels"]) for station in document["stations"]] == [36] * 12


def test_the_number_of_workers_changes_no_byte(handeye, features_file, tmp_path):
    path = tmp_path / "features.yaml"
    assert handeye("extract", RECORDING, "-o", path, "--workers", 1).code == 0
    assert path.read_bytes() == features_file.read_bytes()


def test_step_by_step_and_at_once_give_the_same_answer_near_the_truth(
    handeye, features_file, tmp_path
):
    stations, stepwise = tmp_path / "stations.yaml", tmp_path / "stepwise.yaml"
    assert handeye("extrinsics", features_file, "-o", stations).code == 0
    assert handeye("solve", stations, "-o", stepwise).code == 0
    at_once = yaml.safe_load(handeye("solve", RECORDING).out)
    document = yaml.safe_load(stepwise.read_text())
    for key in ("translation", "quaternion"):  # poses written down lose their last bit
        exact = pytest.approx(at_once["gripper_T_camera"][key], abs=1e-12)
        assert document["gripper_T_camera"][key] == exact
    assert [step["command"] for step in document["provenance"]] == [
        "simulate recording",
        "extract",
        "extrinsics",
        "solve",
    ]
    truth = yaml.safe_load((SAMPLE / "truth.yaml").read_text())["gripper_T_camera"]
    answer = document["gripper_T_camera"]
    R, R_true = (
        rotations.matrix_from_quaternion(np.array(pose["quaternion"])) for pose in (answer, truth)
    )
    distance = np.linalg.norm(np.subtract(answer["translation"], truth["translation"]))
    # Three times the RMS is passed once in some thousand draws; the sample is a fixed one.
    assert rotations.angle(R @ R_true.T) < 3e-3 * document["predicted_error"]["rotation_mrad"]
    assert distance < 3e-3 * document["predicted_error"]["translation_mm"]


def test_the_papers_table_from_a_recording(handeye, features_file):
    rows = yaml.safe_load(handeye("verify", features_file, "--stations", "4,6").out)["rows"]
    assert [row["stations"] for row in rows] == [4, 6]
    assert max(row["rotation_mrad"] for row in rows) < 2
    assert max(row["translation_mm"] for row in rows) < 1


def test_a_terminal_gets_a_report_of_every_station(handeye, features_file):
    extracted = features_file.with_suffix(".report").read_text(encoding="utf-8")
    done = handeye("extrinsics", features_file, terminal=True)
    assert done.code == 0
    for report in (extracted, done.out):
        assert "12 of 12" in report
        assert all(f"\n  {i:02d} " in report for i in range(12))


def test_a_corrected_length_scales_the_poses(handeye, features_file):
    target = "disc-grid:6x6:10mm:8mm"
    poses = [
        yaml.safe_load(handeye("extrinsics", features_file, *flags).out)["stations"][0]
        for flags in ([], ["--target", target])
    ]
    near, far = (np.array(pose["camera_T_target"]["translation"]) for pose in poses)
    np.testing.assert_allclose(far, 2 * near, rtol=1e-4)
