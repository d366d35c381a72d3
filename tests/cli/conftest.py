"""The command line in this process, or in one of its own."""

import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass

import pytest
from cli.scene import stations_document

from handeye_cli.cli import app


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def handeye(monkeypatch, capsys):
    """Run `handeye` in this process; `terminal` pretends that a person looks at stdout.

    `entry` takes the words.
    """
    monkeypatch.setenv("TERM", "dumb")

    def run(*words, stdin=b"", terminal=False, entry=app.run):
        capsys.readouterr()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
            patch.setattr(sys.stdout, "isatty", lambda: terminal)
            with pytest.raises(SystemExit) as end:
                entry([str(word) for word in words])
        captured = capsys.readouterr()
        return Done(end.value.code, captured.out, captured.err)

    return run


@pytest.fixture
def shell():
    """Run a line of bash, in which `handeye` is the command, as a process of its own."""

    def run(line):
        handeye = f'handeye() {{ "{sys.executable}" -m handeye_cli "$@"; }}\n'
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", handeye + line],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
            env={**os.environ, "TERM": "dumb"},
        )
        return Done(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def stations_file(tmp_path):
    """A document of ten stations, poses only."""
    path = tmp_path / "stations.json"
    path.write_text(json.dumps(stations_document(10)), encoding="utf-8")
    return path


@pytest.fixture
def calibration_file(handeye, stations_file, tmp_path):
    path = tmp_path / "calibration.yaml"
    assert handeye("solve", stations_file, "-o", path).code == 0
    return path
