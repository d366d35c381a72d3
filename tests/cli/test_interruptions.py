"""Commands that write and are stopped on the way: the right exit code, and nothing half done."""

from __future__ import annotations

import gc
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from line.conftest import good
from line.good_input import write
from line.recordings import SAMPLE

from handeye_cli.cli import app

__all__ = ["good"]

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and limits as on POSIX")

SMALL = ["--width", "160", "--height", "120", "--focal-px", "140", "--stations", "4"]
COMMANDS = {
    "extract": ["extract", "plate/recording.yaml", "-o", "out.yaml", "--draw", "pictures"],
    "solve": ["solve", "stations.yaml", "-o", "out.yaml"],
    "solve-mcap": ["solve", "stations.yaml", "-o", "out.yaml", "--mcap", "answer.mcap"],
    "export": ["export", "calibration.yaml", "--to", "kalibr", "-o", "out.yaml"],
    "import": ["import", "arm.samples", "--setup", "eye-in-hand", "-o", "out.yaml"],
    "plan": ["plan", "--stations", "5", "-o", "out.yaml"],
    "simulate": ["simulate", "recording", *SMALL, "-o", "made"],
    "simulate-mcap": ["simulate", "recording", *SMALL, "--rate", "2", "-o", "made.mcap"],
    "report": ["report", "calibration.yaml", "-o", "page.html"],
}
SIGNALS = [
    *((signal.SIGTERM, row) for row in COMMANDS),
    *((signal.SIGINT, row) for row in ("extract", "export", "simulate")),
]
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
QUIET = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
HANDEYE = [sys.executable, "-m", "handeye_cli"]
CORPUS = Path(__file__).resolve().parents[1] / "fuzz" / "corpus"


@pytest.fixture
def here(good, tmp_path):
    """A folder with something to read for every command."""
    for kind in ("stations", "calibration"):
        write(tmp_path / f"{kind}.yaml", good[kind])
    (tmp_path / "plate" / "images").mkdir(parents=True)
    recording = good["recording"] | {"stations": good["recording"]["stations"][:1]}
    image = recording["stations"][0]["image"]
    shutil.copy(SAMPLE / image, tmp_path / "plate" / image)
    write(tmp_path / "plate" / "recording.yaml", recording)
    shutil.copy(CORPUS / "samples" / "arm.samples", tmp_path)
    return tmp_path


@pytest.fixture
def main(handeye, here, monkeypatch):
    """Run `handeye` here as a process of its own would: what signals do is put back afterwards."""

    def run(*words, hangup=signal.SIG_DFL):
        starts = {
            signal.SIGINT: signal.default_int_handler,
            signal.SIGTERM: signal.SIG_DFL,
            signal.SIGHUP: hangup,
            signal.SIGPIPE: signal.SIG_IGN,
        }
        with monkeypatch.context() as patch, handlers(starts):
            patch.chdir(here)
            patch.setenv("OPENCV_LOG_LEVEL", "OFF")
            patch.setattr(sys, "argv", ["handeye", *words])
            patch.setattr(sys, "excepthook", sys.excepthook)
            return handeye(*words, entry=lambda _: app.main())

    return run


@contextmanager
def handlers(wanted):
    threshold = gc.get_threshold()
    before = {number: signal.signal(number, handler) for number, handler in wanted.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        gc.set_threshold(*threshold)


def stop_at_the_first_file(monkeypatch, number):
    """Send this process a signal when a file is written and has not got its name yet."""
    whole = os.fsync

    def fsync(descriptor):
        # what nobody handles would end more than the command
        assert signal.getsignal(number) is not signal.SIG_DFL
        os.kill(os.getpid(), number)
        time.sleep(0.2)
        whole(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)


def run(words, folder, **more):
    return subprocess.run(
        words, capture_output=True, cwd=folder, timeout=60, check=False, env=QUIET, **more
    )


def names(folder):
    return sorted(path.relative_to(folder) for path in folder.rglob("*"))


@pytest.mark.parametrize(("number", "row"), SIGNALS)
def test_a_signal_while_a_file_is_written_leaves_nothing(main, here, monkeypatch, row, number):
    before = names(here)
    stop_at_the_first_file(monkeypatch, number)
    done = main(*COMMANDS[row])
    assert (done.code, done.out) == (CODES[number], ""), done.err
    assert "Traceback" not in done.err
    assert names(here) == before


STOPPED = """
import os, sys
from handeye_cli.cli.app import main

number = int(sys.argv.pop(1))
os.fsync = lambda _: os.kill(os.getpid(), number)
main()
"""


@pytest.mark.parametrize("number", CODES)
def test_a_process_that_is_stopped_has_the_exit_code_of_its_signal(here, number):
    before = names(here)
    done = run([sys.executable, "-c", STOPPED, str(int(number)), *COMMANDS["export"]], here)
    assert (done.returncode, done.stdout) == (CODES[number], b""), done.stderr
    assert b"Traceback" not in done.stderr
    assert names(here) == before


@contextmanager
def files_of_at_most(size):
    """A limit on the size of files is what a full disk is to a writer."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("row", ["extract", "solve-mcap", "import", "simulate", "report"])
def test_a_file_that_cannot_be_finished_is_none(main, here, row):
    before = names(here)
    with files_of_at_most(100):
        done = main(*COMMANDS[row])
    assert done.code == 3, done.err
    errors = [line for line in done.err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1, done.err
    assert "cannot be written: File too large" in errors[0]
    assert "Traceback" not in done.err
    assert names(here) == before


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 16 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = shutil.which("mount")
    options = ["-t", "tmpfs", "-o", "size=16k", "none", str(place)]
    if mount is None or run([mount, *options], tmp_path).returncode:
        pytest.skip("no disk can be mounted here")
    yield place
    run([shutil.which("umount"), str(place)], tmp_path)


def test_a_full_disk(main, small_disk):
    done = main("simulate", "recording", *SMALL, "-o", str(small_disk / "made"))
    assert done.code == 3
    assert "cannot be written: No space left on device" in done.err
    assert names(small_disk) == []


@pytest.mark.parametrize("row", ["export", "report", "simulate"])
def test_a_place_where_nobody_can_write(main, here, row):
    """The file systems of the kernel take no files, not even root's."""
    if not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    *words, name = COMMANDS[row]
    before = names(here)
    done = main(*words[:-1], "-o", f"/proc/self/{name}")
    assert done.code == 3, done.err
    assert done.err.startswith("error: ")
    assert "Traceback" not in done.err
    assert names(here) == before


@pytest.mark.parametrize("row", ["solve", "export"])
def test_a_reader_that_is_gone_ends_a_command_quietly(here, row):
    end, start = os.pipe()
    os.close(end)
    words = COMMANDS[row][: COMMANDS[row].index("-o")]
    with os.fdopen(start, "wb") as closed:
        done = subprocess.run(
            [*HANDEYE, *words], stdout=closed, stderr=subprocess.PIPE, cwd=here, env=QUIET,
            check=False, timeout=60,
        )  # fmt: skip
    assert done.returncode == -signal.SIGPIPE
    assert b"error" not in done.stderr
    assert b"Traceback" not in done.stderr


def test_what_the_caller_ignores_is_ignored(main, here, monkeypatch):
    """`nohup` lets a command outlive its terminal."""
    stop_at_the_first_file(monkeypatch, signal.SIGHUP)
    done = main(*COMMANDS["plan"], hangup=signal.SIG_IGN)
    assert done.code == 0, done.err
    assert (here / "out.yaml").exists()
