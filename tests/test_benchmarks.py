"""The benchmarks run, and write what they measured."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SMALL = ["--trials", "20", "--planned", "3", "--recordings", "1", "--runs", "1", "--largest", "10"]


def run(*words):
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", "--quick", *words],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )


@pytest.mark.many_runs
def test_tables_are_printed_and_written(tmp_path):
    done = run("planning", "solving.accuracy", "startup", *SMALL, "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    written = json.loads((tmp_path / "performance.json").read_text(encoding="utf-8"))
    tables = written["tables"]
    assert list(tables) == [
        "solving_paper",
        "solving_general",
        "planning",
        "startup",
        "startup_profile",
    ]
    assert written["machine"].keys() >= {"cores", "Python", "numpy", "handeye"}
    assert written["effort"]["trials"] == 20
    circle, at_random, chosen = tables["planning"]["rows"]
    assert chosen["rotation [mrad]"] < circle["rotation [mrad]"]
    assert at_random["translation [mm]"] < circle["translation [mm]"]
    best = tables["solving_paper"]["rows"][0]
    assert best["method"] == "maximum-likelihood"
    assert 0.6 < best["rotation, N = 7"] < 1.5  # 20 trials: 60 squares, within 5 sigma
    assert tables["startup"]["rows"][0]["over numpy"] == 1.0
    page = (tmp_path / "performance.md").read_text(encoding="utf-8")
    assert "| maximum-likelihood |" in page
    assert all(
        table["title"] in page and table["title"] in done.stdout for table in tables.values()
    )


def test_an_unknown_topic_is_refused():
    done = run("planing")
    assert done.returncode == 1
    assert "found planing" in done.stderr
