"""`handeye import`: the document it writes, what it tells, and what it refuses."""

import json
import shlex

import numpy as np
import pytest
import yaml
from cli.scene import BASE_T_TARGET, TRUTH
from documents import foreign_files
from documents.foreign_files import FORMS, Shots, written

from handeye_cli import documents
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3, station_generator

BOARD = ("--target", "chessboard:9x6:20mm")
IN_HAND = ("--setup", "eye-in-hand")


@pytest.fixture
def samples(tmp_path):
    """Samples of easy_handeye2 around a known answer."""
    places = station_generator.generate_stations(8, 0.3, np.radians(35))
    robot = station_generator.robot_poses(places, TRUTH, BASE_T_TARGET, Setup.EYE_IN_HAND)
    rng = np.random.default_rng(2)
    robot = se3.perturb(robot, 1e-5 * rng.normal(size=(8, 6)))
    path, _ = FORMS["easy_handeye2-untold"].write(
        Shots(Setup.EYE_IN_HAND, robot, se3.inverse(places)), tmp_path
    )
    return path


def test_one_minute_from_samples_to_an_answer(handeye, samples, tmp_path):
    stations = tmp_path / "stations.yaml"
    done = handeye("import", samples, *IN_HAND, "-o", stations, terminal=True)
    assert (done.code, done.err) == (0, "")
    assert done.out == (
        f"{samples}: easy-handeye, eye-in-hand, 8 stations\n  next: handeye solve {stations}\n"
    )
    answer = handeye("solve", stations, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)["gripper_T_camera"]["translation"]
    np.testing.assert_allclose(found, TRUTH[:3, 3], atol=1e-4)


def test_the_document_knows_where_it_comes_from(handeye, samples):
    done = handeye("import", samples, *IN_HAND, "--json")
    (step,) = json.loads(done.out)["provenance"]
    assert step["command"] == "import"
    assert step["options"] == {"from": "easy-handeye", "setup": "eye-in-hand"}
    assert [entry["file"] for entry in step["inputs"]] == [str(samples)]


def test_a_pipe_takes_it(shell, samples):
    done = shell(f"handeye import '{samples}' --setup eye-in-hand | handeye solve - --json")
    assert done.code == 0, done.err
    steps = json.loads(done.out)["provenance"]
    assert [step["command"] for step in steps] == ["import", "solve"]


def test_a_recording_names_its_images_from_its_own_folder(handeye, tmp_path):
    written(tmp_path, "industrial_calibration")
    output = tmp_path / "recording.yaml"
    done = handeye("import", tmp_path / "cal_data.yaml", *BOARD, "-o", output, terminal=True)
    assert done.code == 0, done.err
    assert "have no distortion" in done.err
    assert done.out.endswith(f"next: handeye solve {output}\n")
    data = yaml.safe_load(output.read_text(encoding="utf-8"))
    assert [station["image"] for station in data["stations"]][:2] == [
        "images/0.png",
        "images/1.png",
    ]
    assert data["target"]["type"] == "chessboard"
    inputs = [entry["file"] for entry in data["provenance"][0]["inputs"]]
    poses = [f"poses/{index}.yaml" for index in range(4)]
    assert inputs == [str(tmp_path / name) for name in ("cal_data.yaml", *poses)]
    assert len(documents.read(str(output)).stations) == 4


def test_intrinsics_from_a_file_of_their_own(handeye, tmp_path):
    written(tmp_path, "industrial_calibration")
    camera = tmp_path / "camera.yaml"
    camera.write_text("{fx: 70, fy: 71, cx: 30, cy: 20, distortion: [0.1, 0, 0, 0, 0]}")
    words = ("import", tmp_path / "cal_data.yaml", *BOARD, "--camera", camera)
    done = handeye(*words, "-o", tmp_path / "recording.yaml")
    assert (done.code, done.err) == (0, "")
    data = yaml.safe_load((tmp_path / "recording.yaml").read_text(encoding="utf-8"))
    assert (data["camera"]["width"], data["camera"]["fx"]) == (64, 70)
    assert data["provenance"][0]["inputs"][-1]["file"] == str(camera)
    assert data["provenance"][0]["options"]["camera"] == str(camera)


def test_intrinsics_left_to_solve(handeye, tmp_path):
    written(tmp_path, "robot_cal_tools")
    words = ("import", tmp_path / "data.yaml", *IN_HAND, *BOARD, "-o", tmp_path / "recording.yaml")
    done = handeye(*words, terminal=True)
    assert done.code == 3
    assert "expected the camera's intrinsics, found none" in done.err
    assert not (tmp_path / "recording.yaml").exists()
    done = handeye(*words, "--no-camera", terminal=True)
    assert done.code == 0, done.err
    assert done.out.endswith("recording.yaml --calibrate-intrinsics\n")
    assert "camera" not in yaml.safe_load((tmp_path / "recording.yaml").read_text())


def test_a_document_elsewhere_asks_for_leave(handeye, tmp_path):
    written(tmp_path, "csv-with-images")
    (tmp_path / "out").mkdir()
    output = tmp_path / "out" / "recording.yaml"
    words = ("import", tmp_path / "poses.csv", *IN_HAND, *BOARD, "--no-camera", "-o", output)
    done = handeye(*words)
    assert done.code == 3
    assert f"-o {tmp_path}/shots/recording.yaml" in done.err
    assert handeye(*words, "--allow-outside").code == 0
    data = yaml.safe_load(output.read_text(encoding="utf-8"))
    assert data["stations"][0]["image"] == "../shots/0.png"
    done = handeye(*words, "--allow-outside", "--force", terminal=True)
    assert "--allow-outside --calibrate-intrinsics" in done.out


def test_a_table_with_all_its_flags(handeye, tmp_path):
    written(tmp_path, "csv-by-number")
    words = ("import", tmp_path / "poses.csv", "--from", "trajectory", "--images",
             tmp_path / "frames", "--rotation", "ZYX:deg", "--pose-units", "mm")  # fmt: skip
    done = handeye(*words, *IN_HAND, *BOARD, "--no-camera", "-o", tmp_path / "recording.json")
    assert done.code == 0, done.err
    record = documents.read(str(tmp_path / "recording.json"))
    expected = foreign_files.shots().base_T_gripper
    found = np.array([station.base_T_gripper for station in record.stations])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    options = record.provenance[0].options
    assert options["rotation"] == "ZYX:deg"
    assert options["no-camera"] is True


def test_without_an_output_a_person_is_told_about_it(handeye, samples):
    done = handeye("import", samples, *IN_HAND, terminal=True)
    assert done.code == 0
    assert done.out.endswith("  write the document with -o FILE\n")
    assert handeye("import", samples, *IN_HAND, "-q", terminal=True).out == ""


def test_the_next_command_can_be_copied_whatever_the_file_is_called(
    handeye, samples, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    done = handeye("import", samples, *IN_HAND, "-o", "cell 4's.yaml", terminal=True)
    assert done.out.endswith("""  next: handeye solve 'cell 4'"'"'s.yaml'\n""")
    done = handeye("import", samples, *IN_HAND, "--output=-4.yaml", terminal=True)
    assert done.out.endswith("  next: handeye solve ./-4.yaml\n")
    (line,) = [each for each in done.out.splitlines() if "next: " in each]
    assert handeye(*shlex.split(line.partition("next: handeye ")[2])).code == 0


def test_one_file_is_imported_at_a_time(handeye, samples):
    done = handeye("import", samples, "other.samples", *IN_HAND)
    assert (done.code, done.out) == (2, "")
    assert "other.samples" in done.err


REFUSED = [
    ((), 3, "--setup eye-in-hand|eye-to-hand"),
    ((*IN_HAND, "--from", "movit"), 2, "did you mean moveit?"),
    ((*IN_HAND, "--from", "moveit"), 3, "expected a list of at least one entry"),
    ((*IN_HAND, "--images", "x"), 2, "--images acts on a CSV or TUM table"),
    ((*IN_HAND, "--camera", "x", "--no-camera"), 2, "found both"),
    ((*IN_HAND, "--target", "chess:9x6"), 2, "found 'chess'"),
    ((*IN_HAND, "-o", "nowhere/stations.yaml"), 3, "existing folder"),
]


@pytest.mark.parametrize(("words", "code", "message"), REFUSED)
def test_refused(handeye, samples, words, code, message):
    done = handeye("import", samples, *words)
    assert (done.code, done.out) == (code, "")
    assert message in done.err
    assert "Traceback" not in done.err
