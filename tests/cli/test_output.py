"""Where results go: files, pipes, terminals."""

import json

import pytest
import yaml


def test_a_pipe_gets_the_document(handeye, stations_file):
    done = handeye("solve", stations_file)
    assert done.code == 0
    assert done.out.startswith("schema: handeye/calibration/1\n")


def test_json_on_demand_is_the_same_document(handeye, stations_file):
    as_json = json.loads(handeye("solve", stations_file, "--json").out)
    assert as_json == yaml.safe_load(handeye("solve", stations_file).out)


def test_a_terminal_gets_the_report(handeye, stations_file):
    done = handeye("solve", stations_file, terminal=True)
    assert done.code == 0
    assert done.out.startswith("gripper_T_camera: ")
    assert "schema" not in done.out
    assert "translation" in done.out


def test_json_wins_over_the_report(handeye, stations_file):
    done = handeye("solve", stations_file, "--json", terminal=True)
    assert json.loads(done.out)["schema"] == "handeye/calibration/1"


def test_quiet_shows_nothing_on_a_terminal(handeye, stations_file, tmp_path):
    done = handeye("solve", stations_file, "-q", "-o", tmp_path / "a.yaml", terminal=True)
    assert (done.code, done.out, done.err) == (0, "", "")


def test_a_file_gets_the_document_and_the_terminal_the_report(handeye, stations_file, tmp_path):
    path = tmp_path / "a.yaml"
    done = handeye("solve", stations_file, "-o", path, terminal=True)
    assert done.out.startswith("gripper_T_camera: ")
    assert path.read_text().startswith("schema: handeye/calibration/1\n")


def test_a_file_leaves_a_pipe_empty(handeye, stations_file, tmp_path):
    done = handeye("solve", stations_file, "-o", tmp_path / "a.json")
    assert (done.code, done.out) == (0, "")
    assert json.loads((tmp_path / "a.json").read_text())["schema"] == "handeye/calibration/1"


def test_a_dash_is_stdout_on_a_terminal_too(handeye, stations_file):
    done = handeye("solve", stations_file, "-o", "-", terminal=True)
    assert done.out.startswith("schema: handeye/calibration/1\n")


def test_the_same_input_and_flags_give_the_same_bytes(handeye, stations_file, tmp_path):
    for name in ("a.yaml", "b.yaml"):
        assert handeye("solve", stations_file, "-o", tmp_path / name).code == 0
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "b.yaml").read_bytes()


def test_an_existing_file_is_kept_and_said_before_the_input_is_read(handeye, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("mine")
    done = handeye("solve", tmp_path / "none.yaml", "-o", path)
    assert (done.code, done.out) == (2, "")
    assert "a.yaml: the file exists already" in done.err
    assert "hint: replace it with --force" in done.err
    assert path.read_text() == "mine"


def test_force_replaces_a_file(handeye, stations_file, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("mine")
    assert handeye("solve", stations_file, "-o", path, "--force").code == 0
    assert path.read_text().startswith("schema: ")


def test_force_keeps_the_old_file_when_the_command_fails(handeye, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("mine")
    assert handeye("solve", tmp_path / "none.yaml", "-o", path, "--force").code == 3
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", ["solve", "verify"])
def test_a_result_can_be_read_again(handeye, stations_file, tmp_path, command):
    path = tmp_path / "a.yaml"
    assert handeye(command, stations_file, "-o", path).code == 0
    done = handeye("extrinsics", path)  # refused for its kind, thus valid as a document
    assert done.code == 3
    assert "expected a recording or features document, found a " in done.err
