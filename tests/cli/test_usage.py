"""Wrong usage: exit 2, said before anything is read, and `--help` that teaches."""

import pytest

import handeye_cli

COMMANDS = [
    "extract",
    "extrinsics",
    "solve",
    "verify",
    "batch",
    "export",
    "import",
    "inspect",
    "report",
    "plan",
    "simulate",
    "simulate recording",
]
PLAN = ["plan", "--stations", "7", "--distance", "170mm", "--tilt", "30deg"]


@pytest.mark.parametrize(
    "words",
    [
        ["slove"],
        ["solve"],
        ["solve", "in.yaml", "--metod", "tsai-lenz"],
        ["solve", "in.yaml", "--setup", "on-the-head"],
        ["solve", "in.yaml", "--pairs", "some"],
        ["solve", "in.yaml", "--workers", "0"],
        ["verify", "in.yaml", "--max-rotation-mrad", "-1"],
        ["plan", "--distance", "170mm"],
        ["plan", "--stations", "10000000000"],
        ["plan", "--stations", "5", "--verification", "10000000000"],
        ["plan", "--stations", "seven", "--distance", "1m", "--tilt", "30deg"],
    ],
)
def test_words_typer_refuses(handeye, words):
    done = handeye(*words)
    assert (done.code, done.out) == (2, "")
    assert done.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["solve", "none.yaml", "--method", "tsai-lens"], "did you mean tsai-lenz?"),
        (["verify", "none.yaml", "--method", "best"], "'best'"),
        (["verify", "none.yaml", "--stations", "4;6"], "'4;6'"),
        (["verify", "none.yaml", "--stations", "4,,6"], "'4,,6'"),
        (["verify", "none.yaml", "--stations", "4", "--calibration", "c.yaml"], "exclude"),
        (["solve", "none.mcap", "--time-offset", "40"], "'40'"),
        (["solve", "none.mcap", "--pose-units", "mm"], "--pose-units acts on a document only"),
        (["solve", "none.yaml", "--image-topic", "/a"], "--image-topic acts on an MCAP recording"),
        ([*PLAN[:3], "--distance", "170", "--tilt", "30deg"], "'170'"),
        ([*PLAN[:3], "--distance", "170mm", "--tilt", "30mm"], "'30mm'"),
        ([*PLAN, "--verification", "8"], "found 8"),
        (["plan", "--stations", "2", "--distance", "1m", "--tilt", "30deg"], "found 2"),
        (["solve", "none.yaml", "--target", "disk-grid:6x6:5mm:4mm"], "disk-grid"),
    ],
)
def test_values_that_are_refused_before_anything_is_read(handeye, words, message):
    done = handeye(*words)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: ")
    assert message in done.err


def test_intrinsics_cannot_be_calibrated_from_poses(handeye, stations_file):
    done = handeye("solve", stations_file, "--calibrate-intrinsics")
    assert (done.code, done.out) == (2, "")
    assert "--calibrate-intrinsics" in done.err
    assert "stations document" in done.err


def test_a_target_cannot_be_changed_behind_the_poses(handeye, stations_file):
    done = handeye("solve", stations_file, "--target", "disc-grid:6x6:5mm:4mm")
    assert (done.code, done.out) == (2, "")
    assert "--target cannot replace" in done.err
    assert "stations document" in done.err


def test_version(handeye):
    done = handeye("--version")
    assert (done.code, done.out) == (0, f"handeye {handeye_cli.__version__}\n")


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_examples_and_fits_eighty_columns(handeye, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "80")
    done = handeye(*command.split(), "--help")
    assert done.code == 0
    assert done.out.count(f"$ handeye {command} ") >= 1
    assert done.out.count("$ handeye ") >= 2
    assert max(map(len, done.out.splitlines())) <= 80


def test_no_words_show_the_help(handeye):
    done = handeye()
    assert "solve" in done.out + done.err
    assert "Usage" in done.out + done.err
