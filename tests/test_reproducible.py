"""The same input and flags give the same bytes, whatever the machine does beside it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli.conftest import handeye

__all__ = ["handeye"]

RECORDING = str(Path(__file__).resolve().parents[1] / "sample_data/paper-plate/recording.yaml")
QUIET = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
BUSY = {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "12345"}
COMMANDS = {
    "simulate": ["simulate", "--trials", "50", "--seed", "3"],
    "plan": ["plan", "--stations", "3", "--optimize", "--tilt", "20deg"],
    "verify": ["verify", RECORDING, "--stations", "4"],
    "solve": ["solve", RECORDING, "--workers"],
}
PROGRAM = """
import contextlib, json, sys
from handeye_cli.cli.app import run
for words in json.loads(sys.argv[1]):
    with contextlib.suppress(SystemExit):
        run(words)
"""


def documents(folder, environment, workers):
    """Run all commands in one process, and return the bytes that each has written."""
    commands = COMMANDS | {"solve": [*COMMANDS["solve"], workers]}
    words = [[*each, "-q", "-o", f"{name}.yaml"] for name, each in commands.items()]
    subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(words)],
        check=True,
        cwd=folder,
        env={**os.environ, **environment},
    )
    return {name: (folder / f"{name}.yaml").read_bytes() for name in COMMANDS}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return (
        documents(tmp_path_factory.mktemp("quiet"), QUIET, "1"),
        documents(tmp_path_factory.mktemp("busy"), BUSY, "2"),
    )


@pytest.mark.xdist_group("reproducible")  # the documents are written once
@pytest.mark.parametrize("name", COMMANDS)
def test_threads_hashes_and_workers_change_no_byte(name, written):
    quiet, busy = written
    assert quiet[name] == busy[name]


def test_the_seed_is_in_the_document_and_another_gives_other_numbers(handeye):
    simulate = ["simulate", "--trials", "20", "--json", "--seed"]
    first, other = (json.loads(handeye(*simulate, seed, "-q").out) for seed in ("3", "4"))
    assert (first["seed"], other["seed"]) == (3, 4)
    assert first["provenance"][-1]["options"]["seed"] == 3
    assert first["rotation_rms_mrad"] != other["rotation_rms_mrad"]
