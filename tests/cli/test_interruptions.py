"""Commands that write and are stopped on the way: the right exit code, and nothing half done."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from line.good_input import documents_of_the_line, write
from line.recordings import SAMPLE

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and limits as on POSIX")

STOPPED_AT = """
import os, signal, sys, time
from handeye_cli.documents import files

number, whole = int(sys.argv.pop(1)), os.fsync

def fsync(descriptor):
    os.kill(os.getpid(), number)
    time.sleep(0.2)
    whole(descriptor)

files.os.fsync = fsync
from handeye_cli.cli.app import main
main()
"""
"""A process that gets a signal when its first file is written and has not got its name yet."""

COMMANDS = {
    "extract": ["extract", "plate/recording.yaml", "-o", "out.yaml", "--draw", "pictures"],
    "solve": ["solve", "stations.yaml", "-o", "out.yaml"],
    "solve-mcap": ["solve", "stations.yaml", "-o", "out.yaml", "--mcap", "answer.mcap"],
    "export": ["export", "calibration.yaml", "--to", "kalibr", "-o", "out.yaml"],
    "import": ["import", "arm.samples", "--setup", "eye-in-hand", "-o", "out.yaml"],
    "plan": ["plan", "--stations", "5", "-o", "out.yaml"],
    "simulate": ["simulate", "recording", "-o", "made"],
    "simulate-mcap": ["simulate", "recording", "-o", "made.mcap"],
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
def here(tmp_path):
    """A folder with something to read for every command."""
    good = documents_of_the_line()
    for kind in ("stations", "calibration"):
        write(tmp_path / f"{kind}.yaml", good[kind])
    (tmp_path / "plate" / "images").mkdir(parents=True)
    recording = good["recording"] | {"stations": good["recording"]["stations"][:1]}
    image = recording["stations"][0]["image"]
    shutil.copy(SAMPLE / image, tmp_path / "plate" / image)
    write(tmp_path / "plate" / "recording.yaml", recording)
    shutil.copy(CORPUS / "samples" / "arm.samples", tmp_path)
    return tmp_path


def run(words, folder, **more):
    return subprocess.run(
        words, capture_output=True, cwd=folder, timeout=60, check=False, env=QUIET, **more
    )


def names(folder):
    return sorted(path.relative_to(folder) for path in folder.rglob("*"))


@pytest.mark.parametrize(("number", "row"), SIGNALS)
def test_a_signal_while_a_file_is_written_leaves_nothing(here, row, number):
    before = names(here)
    words = [sys.executable, "-c", STOPPED_AT, str(int(number)), *COMMANDS[row]]
    done = run(words, here)
    assert done.returncode == CODES[number], done.stderr
    assert done.stdout == b""
    assert b"Traceback" not in done.stderr
    assert names(here) == before


@pytest.mark.parametrize("row", ["extract", "solve-mcap", "import", "simulate", "report"])
def test_a_file_that_cannot_be_finished_is_none(here, row):
    """A limit on the size of files is what a full disk is to a writer."""
    before = names(here)

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    done = run([*HANDEYE, *COMMANDS[row]], here, preexec_fn=limit)
    assert done.returncode == 3, done.stderr
    errors = [line for line in done.stderr.splitlines() if line.startswith(b"error: ")]
    assert len(errors) == 1, done.stderr
    assert b"cannot be written: File too large" in errors[0]
    assert b"Traceback" not in done.stderr
    assert names(here) == before


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 64 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = shutil.which("mount")
    options = ["-t", "tmpfs", "-o", "size=64k", "none", str(place)]
    if mount is None or run([mount, *options], tmp_path).returncode:
        pytest.skip("no disk can be mounted here")
    yield place
    run([shutil.which("umount"), str(place)], tmp_path)


def test_a_full_disk(here, small_disk):
    made = small_disk / "made"
    done = run([*HANDEYE, "simulate", "recording", "-o", str(made)], here)
    assert done.returncode == 3
    assert b"cannot be written: No space left on device" in done.stderr
    assert names(small_disk) == []


@pytest.mark.parametrize("row", ["export", "report", "simulate"])
def test_a_place_where_nobody_can_write(here, row):
    """The file systems of the kernel take no files, not even root's."""
    if not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    *words, name = COMMANDS[row]
    before = names(here)
    done = run([*HANDEYE, *words[:-1], "-o", f"/proc/self/{name}"], here)
    assert done.returncode == 3, done.stderr
    assert done.stderr.startswith(b"error: ")
    assert b"Traceback" not in done.stderr
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


def test_what_the_caller_ignores_is_ignored(here):
    """`nohup` lets a command outlive its terminal."""
    words = [sys.executable, "-c", STOPPED_AT, str(int(signal.SIGHUP)), *COMMANDS["plan"]]
    done = run(words, here, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    assert done.returncode == 0, done.stderr
    assert (here / "out.yaml").exists()
