"""`handeye batch`: many recordings, of which some are bad."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
import yaml
from cli.scene import stations_document
from engines.clusters import small_cluster

from handeye_cli.cli import app, batch_work
from handeye_cli.cli.batch_names import recording_names, unique_names
from handeye_cli.errors import InputError, UsageError

LIMIT = "0.8"
"""Millimetres that one recording misses and the good ones keep."""


@dataclass(frozen=True)
class Night:
    """A batch that has ended.

    Attributes:
        names: Its recordings.
        code: Its exit code.
        out: Its document.
        err: What it said.
        answers: The calibrations by the names of their files.
    """

    names: list[str]
    code: int
    out: str
    err: str
    answers: dict[str, bytes]


def write(path, document):
    path.write_text(json.dumps(document), encoding="utf-8")
    return str(path)


def loose_document():
    """Stations whose camera is ten times less sure of distances than the others' are."""
    document = stations_document(10, seed=3)
    shifts = np.random.default_rng(3).normal(0.0, 6e-4, (10, 3))
    for shift, station in zip(shifts, document["stations"], strict=True):
        pose = station["camera_T_target"]
        pose["translation"] = (pose["translation"] + shift).tolist()
    return document


def contradictory_document():
    """Quaternions of the robot turned the other way round."""
    document = stations_document(10, seed=4)
    for station in document["stations"]:
        *axis, real = station["base_T_gripper"]["quaternion"]
        station["base_T_gripper"]["quaternion"] = [*(-each for each in axis), real]
    return document


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Paths of recordings: a good one, three that fail in their own ways, and a good one."""
    folder = tmp_path_factory.mktemp("fleet")
    broken = folder / "broken.json"
    broken.write_text('{"schema": ', encoding="utf-8")
    return [
        write(folder / "first.json", stations_document(10, seed=1)),
        str(broken),
        write(folder / "loose.json", loose_document()),
        write(folder / "contradictory.json", contradictory_document()),
        write(folder / "second.json", stations_document(10, seed=2)),
    ]


@pytest.fixture(scope="module")
def night(fleet, tmp_path_factory):
    """The fleet after a batch."""
    return run_night(fleet, tmp_path_factory.mktemp("night"), "--jobs", "2")


def here(words, folder):
    """Run `handeye` in this process."""
    out, err = StringIO(), StringIO()
    with (
        chdir(folder),
        redirect_stdout(out),
        redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        app.run(words)
    return end.value.code, out.getvalue(), err.getvalue()


def apart(words, folder):
    """Run `handeye` in a process of its own, which the processes it starts find and load again."""
    done = subprocess.run(
        [sys.executable, "-m", "handeye_cli", *words],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        timeout=120,
    )
    return done.returncode, done.stdout, done.stderr


def run_night(fleet, folder, *engine, run=here):
    words = ["batch", *fleet, *engine, "--max-translation-mm", LIMIT, "--out-dir", "answers"]
    ended = run(words, folder)
    answers = {path.name: path.read_bytes() for path in (folder / "answers").iterdir()}
    return Night(fleet, *ended, answers)


def rows_by_name(text):
    return {Path(row["name"]).stem: row for row in yaml.safe_load(text)["rows"]}


def test_every_recording_has_its_row_whatever_became_of_the_others(night):
    document, rows = yaml.safe_load(night.out), rows_by_name(night.out)
    assert [row["name"] for row in document["rows"]] == night.names
    assert (night.code, document["exit_code"]) == (3, 3)
    assert {name: (row["status"], row["exit_code"]) for name, row in rows.items()} == {
        "first": ("ok", 0),
        "broken": ("failed", 3),
        "loose": ("gate", 6),
        "contradictory": ("failed", 4),
        "second": ("ok", 0),
    }
    assert rows["broken"]["message"].startswith("line 2")
    assert f"up to {LIMIT} mm" in rows["loose"]["message"]
    assert "seconds" not in rows["first"]
    (step,) = document["provenance"]
    assert step["options"] == {"max-translation-mm": float(LIMIT)}


def test_what_failed_is_told_the_worst_first(night):
    first, *_, last = night.err.splitlines()
    assert first.startswith(f"failed: {night.names[1]}: line 2")
    assert last == "error: 5 recordings: 2 failed, 1 missed a limit, 2 ok"


@pytest.mark.parametrize("which", [2, 3])
def test_a_row_is_what_the_single_commands_say(handeye, night, which):
    path, row = night.names[which], yaml.safe_load(night.out)["rows"][which]
    solved = handeye("solve", path)
    verified = handeye("verify", path, "--max-translation-mm", LIMIT)
    assert row["exit_code"] == (solved.code or verified.code)
    assert row["message"] in solved.err + verified.err
    if solved.code == 0:
        predicted = yaml.safe_load(solved.out)["predicted_error"]
        (line,) = yaml.safe_load(verified.out)["rows"]
        assert row["predicted_error"]["rotation_mrad"] == predicted["rotation_mrad"]
        assert row["seen_error"]["translation_mm"] == line["translation_mm"]


def test_the_calibrations_are_those_of_solve_to_the_byte(handeye, night, tmp_path):
    assert set(night.answers) == {"first.yaml", "loose.yaml", "second.yaml"}
    handeye("solve", night.names[0], "-o", tmp_path / "alone.yaml")
    assert night.answers["first.yaml"] == (tmp_path / "alone.yaml").read_bytes()
    row = rows_by_name(night.out)["first"]
    assert row["calibration"] == str(Path("answers", "first.yaml"))


def test_the_number_of_jobs_changes_no_byte(fleet, night, tmp_path):
    assert run_night(fleet, tmp_path, "--jobs", "1", run=apart) == night


def test_a_cluster_changes_no_byte(fleet, night, tmp_path):
    with small_cluster() as address:
        assert run_night(fleet, tmp_path, "--scheduler", address) == night


def test_a_terminal_gets_the_table(handeye, fleet, tmp_path):
    listed = tmp_path / "fleet.txt"
    listed.write_text("\n".join(["", fleet[0], "", fleet[1], ""]), encoding="utf-8")
    done = handeye("batch", f"@{listed}", "--times", "--jobs", "1", terminal=True)
    assert done.out.startswith("2 recordings: 1 failed, 1 ok\n")
    lines = done.out.splitlines()
    (heading,) = [line for line in lines if line.split()[:3] == ["recording", "status", "exit"]]
    assert heading.split()[-1] == "s"
    assert lines[-1].startswith(f"failed: {fleet[1]}: line 2")
    assert done.err == "error: 2 recordings: 1 failed, 1 ok\n"


def test_all_well_is_exit_0_without_a_word(handeye, fleet, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # as many jobs at a time, when nothing is said
    out = tmp_path / "batch.json"
    stdin = f"{fleet[0]}\n{fleet[4]}\n".encode()
    done = handeye("batch", "@-", "-o", out, "--times", stdin=stdin)
    assert (done.code, done.out, done.err) == (0, "", "")
    rows = json.loads(out.read_text())["rows"]
    assert [row["status"] for row in rows] == ["ok", "ok"]
    assert all(row["seconds"] > 0 for row in rows)


def test_a_worker_of_another_version_is_told(fleet):
    from handeye_cli.batch import Treatment
    from handeye_cli.cli.batch_options import Recordings
    from handeye_cli.cli.camera_options import CameraFile
    from handeye_cli.cli.options import Mcap

    job = batch_work.Job(
        Recordings(fleet[0]),
        Mcap(),
        CameraFile(),
        Treatment("tsai-lenz"),
        {},
        False,
        version="0.0.7",
    )
    row = batch_work.carry_out(job).row
    assert (row.status, row.exit_code) == ("failed", 2)
    assert "expected handeye 0.0.7 on every worker" in row.message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--method", "tsai-lens"], "did you mean tsai-lenz?"),
        (["--target", "disk-grid:6x6:5mm:4mm"], "disk-grid"),
        (["--time-offset", "40"], "'40'"),
        (["--stations", "4;6"], "'4;6'"),
        (["--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"], "expected --jobs or --scheduler"),
        (["none.json"], "found none.json twice"),
        (["-"], "found '-'"),
    ],
)
def test_wrong_usage_is_told_once_and_before_any_work(handeye, words, message):
    done = handeye("batch", "none.json", *words)
    assert (done.code, done.out) == (2, "")
    assert done.err.count("error: ") == 1
    assert message in done.err


def test_a_camera_that_cannot_be_read_is_told_once_and_before_any_work(handeye, fleet):
    done = handeye("batch", *fleet, "--camera", "none.yaml#cam1")
    assert (done.code, done.out) == (3, "")
    assert done.err.count("none.yaml: ") == 1
    assert done.err.count("error: ") == 1


def test_answers_that_are_there_are_not_replaced(handeye, fleet, tmp_path):
    answers = tmp_path / "answers"
    answers.mkdir()
    (answers / "second.yaml").write_text("mine", encoding="utf-8")
    done = handeye("batch", *fleet, "--out-dir", answers)
    assert (done.code, done.out) == (2, "")
    assert f"{answers / 'second.yaml'}: the file exists already" in done.err
    assert [path.name for path in answers.iterdir()] == ["second.yaml"]


INTERRUPTIBLE = """
import signal
from handeye_cli.cli.app import main
# what is started in the background may have been told to ignore it
signal.signal(signal.SIGINT, signal.default_int_handler)
main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_batch_writes_what_is_done(fleet, tmp_path, number):
    # a pipe that nobody writes to: the work on it does not end by itself
    endless = tmp_path / "endless.json"
    os.mkfifo(endless)
    out, answers = tmp_path / "batch.yaml", tmp_path / "answers"
    names = [fleet[0], str(endless), fleet[4]]
    words = ["batch", *names, "--jobs", "1", "-o", str(out), "--out-dir", str(answers)]
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTIBLE, *words],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    patience = time.monotonic() + 30
    while not (answers / "first.yaml").exists() and time.monotonic() < patience:
        time.sleep(0.05)
    time.sleep(0.3)
    os.killpg(process.pid, number)
    # the pipe is closed when no process is left that might still write into it
    _, told = process.communicate(timeout=30)
    assert process.returncode == 130, told
    rows = yaml.safe_load(out.read_text())["rows"]
    assert [row["status"] for row in rows] == ["ok", "cancelled", "cancelled"]
    assert told == "error: 3 recordings: 2 cancelled, 1 ok\n"


def test_names_of_files_are_as_short_as_they_can_be():
    names = unique_names(
        ["/a/arm.mcap", "/b/one/recording.yaml", "/b/two/recording.yaml", "/b/two", "/c/ARM.yaml"]
    )
    assert names == ["arm.mcap", "one-recording", "two-recording", "two", "ARM.yaml"]


@pytest.mark.parametrize(
    "paths",
    [
        ["/a-b/c.x", "/a/b-c.x", "/b-c.x", "/c.x", "/b/c.x", "/a/b/c.x"],
        ["/a/b", "/a/B", "/A/b"],
        ["/", "/a", "/a.yaml", "/a.yaml.yaml"],
    ],
)
def test_names_of_files_are_never_shared(paths):
    names = unique_names(paths)
    assert len({name.casefold() for name in names}) == len(paths) or len(
        {path.casefold() for path in paths}
    ) < len(paths)
    assert len(set(names)) == len(paths)
    assert not [name for name in names if "/" in name]


def test_a_list_with_zero_bytes_between_the_names(handeye):
    done = handeye("batch", "@-", stdin=b"none.json\na b.mcap\0c.mcap\0")
    assert (done.code, done.out) == (3, "")
    assert done.err.startswith(
        "error: @-: expected one name in each line, found a zero byte after 'a b.mcap'\n"
    )


def test_a_link_to_itself_has_a_name(tmp_path):
    loop = tmp_path / "loop.mcap"
    loop.symlink_to(loop)
    assert recording_names([str(loop)]) == [str(loop)]
    assert unique_names([str(loop)]) == ["loop"]


def test_the_calibration_that_is_verified_is_told_with_its_digest(handeye, fleet, tmp_path):
    answer = tmp_path / "answer.yaml"
    assert handeye("solve", fleet[0], "-o", answer).code == 0
    done = handeye("batch", fleet[0], "--calibration", answer, "--json", "-q")
    (step,) = json.loads(done.out)["provenance"]
    digest = hashlib.sha256(answer.read_bytes()).hexdigest()
    assert step["inputs"] == [{"file": str(answer), "sha256": digest}]


def test_lists_that_cannot_be_read(tmp_path):
    empty, odd = tmp_path / "empty.txt", tmp_path / "odd.txt"
    empty.write_text("\n\n", encoding="utf-8")
    odd.write_bytes(b"\xff\xfe\xff")
    for path, message in (
        (tmp_path / "none.txt", "No such file"),
        (odd, "not UTF-8"),
        (empty, "found an empty list"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            recording_names([f"@{path}"])
        assert caught.value.where == f"@{path}"
    with pytest.raises(UsageError, match="twice"):
        recording_names([str(tmp_path / "a"), str(tmp_path / "b" / ".." / "a")])


def test_the_intrinsics_of_all_are_told_with_their_digest(handeye, fleet):
    camera = Path(__file__).resolve().parents[2] / "sample_data" / "camera.yaml"
    done = handeye("batch", fleet[0], "--camera", camera, "--json", "-q")
    (step,) = json.loads(done.out)["provenance"]
    digest = hashlib.sha256(camera.read_bytes()).hexdigest()
    assert step["inputs"] == [{"file": str(camera), "sha256": digest}]
