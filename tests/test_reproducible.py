"""The same input and flags give the same bytes, whatever the machine does beside it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

RECORDING = Path(__file__).resolve().parents[1] / "sample_data" / "paper-plate" / "recording.yaml"
QUIET = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
BUSY = {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "12345"}


def document(words, environment):
    done = subprocess.run(
        [sys.executable, "-m", "handeye_cli", *words, "-q", "-o", "-"],
        capture_output=True,
        check=True,
        env={**os.environ, **environment},
    )
    return done.stdout


@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "--trials", "50", "--seed", "3"],
        ["plan", "--stations", "3", "--optimize", "--tilt", "20deg"],
        ["verify", str(RECORDING), "--stations", "4"],
    ],
    ids=lambda words: words[0],
)
def test_threads_and_hashes_change_no_byte(words):
    assert document(words, QUIET) == document(words, BUSY)


def test_workers_change_no_byte():
    words = ["solve", str(RECORDING), "--workers"]
    assert document([*words, "1"], QUIET) == document([*words, "2"], BUSY)


def test_the_seed_is_in_the_document_and_another_gives_other_numbers():
    simulate = ["simulate", "--trials", "20", "--json", "--seed"]
    first, other = (json.loads(document([*simulate, seed], QUIET)) for seed in ("3", "4"))
    assert (first["seed"], other["seed"]) == (3, 4)
    assert first["provenance"][-1]["options"]["seed"] == 3
    assert first["rotation_rms_mrad"] != other["rotation_rms_mrad"]
