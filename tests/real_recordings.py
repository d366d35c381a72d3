"""Recordings of real robots that lie beside the checkout, extracted once in a test process."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from handeye_cli import documents
from handeye_cli.extract import extract
from handeye_cli.records import Features, Recording

FOLDER = (Path(__file__).resolve().parents[1] / "../shared/data").resolve()
ONE_PROCESS = pytest.mark.xdist_group("real recordings")
"""Tests with this mark share what was extracted."""


def recording(name: str) -> Recording:
    """Return a recording, or skip the test where there is none."""
    path = FOLDER / name / "recording.yaml"
    if not path.exists():
        pytest.skip(f"no recording at shared/data/{name}, beside the checkout")
    return documents.read(str(path))


@cache
def features(name: str) -> Features:
    """Return what is seen in a recording's images."""
    return extract(recording(name))
