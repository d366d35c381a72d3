"""The command as a process among others: pipes, signals, bugs."""

import os
import signal
import subprocess
import sys

import pytest
import yaml

LARGE_PLAN = "handeye plan --stations 601 --distance 170mm --tilt 30deg"
"""Twice as much text as fits into a pipe."""


def test_a_reader_that_leaves_early_ends_the_command_quietly(shell):
    done = shell(f"{LARGE_PLAN} | head -1")
    assert done.out == "schema: handeye/plan/1\n"
    assert done.err == ""
    assert done.code == 128 + signal.SIGPIPE


def test_ctrl_c_ends_quietly_and_leaves_nothing_behind(tmp_path):
    waiting, output = tmp_path / "input.yaml", tmp_path / "out.yaml"
    os.mkfifo(waiting)
    process = subprocess.Popen(
        [sys.executable, "-m", "handeye_cli", "solve", str(waiting), "-o", str(output)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with waiting.open("wb"):  # opens when the command has come to read its input
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (130, b"", b"")
    assert list(tmp_path.iterdir()) == [waiting]


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("handeye_cli.cli.app", ["--version"]),
        ("handeye_cli.cli.commands", ["solve", "none.yaml"]),
        ("handeye_cli.pipeline", ["solve", "none.yaml"]),
        ("numpy._core.multiarray", ["solve", "none.yaml"]),
        ("typer.main", ["plan", "--stations", "5"]),
        ("handeye_cli.planning", ["plan", "--stations", "5"]),
    ],
)
def test_ctrl_c_while_a_module_is_loaded_ends_quietly(module, words):
    program = (
        "import os, signal, sys\n"
        "class Interrupter:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}:\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupter())\n"
        "from handeye_cli.__main__ import main\n"
        "main()\n"
    )
    command = [sys.executable, "-c", program, *words]
    done = subprocess.run(command, capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"")


def with_a_bug(*words):
    program = (
        "import handeye_cli.cli.plan as command\n"
        "def broken(*_, **__): return 1 / 0\n"
        "command.check_output = broken\n"
        "from handeye_cli.cli.app import main\n"
        "main()\n"
    )
    plan = ["plan", "--stations", "5", "--distance", "170mm", "--tilt", "30deg"]
    return subprocess.run(
        [sys.executable, "-c", program, *plan, *words], capture_output=True, text=True, check=False
    )


def test_a_bug_is_one_line_that_says_how_to_report_it():
    done = with_a_bug()
    assert done.returncode == 1
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert "bug" in line
    assert "ZeroDivisionError: division by zero" in line
    assert "--debug" in line


def test_debug_shows_the_traceback_of_a_bug():
    done = with_a_bug("--debug")
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert "in broken" in done.stderr


def test_a_full_disk_behind_stdout_is_no_bug(shell):
    done = shell(f"{LARGE_PLAN} > /dev/full")
    assert done.code == 3
    assert done.err.startswith("error: standard output: cannot be written: No space left")


def test_documents_flow_through_pipes(shell, stations_file):
    done = shell(f"cat '{stations_file}' | handeye solve - | tee '{stations_file}.out'")
    assert done.code == 0, done.err
    assert yaml.safe_load(done.out)["schema"] == "handeye/calibration/1"


def test_a_failure_in_the_middle_of_a_pipe_is_told_by_the_one_who_failed(shell, tmp_path):
    done = shell(f"handeye extract '{tmp_path}/none.yaml' | handeye extrinsics - | cat")
    assert done.code == 3
    first, *rest = [line for line in done.err.splitlines() if line.startswith("error:")]
    assert "none.yaml" in "".join([first, *rest])
