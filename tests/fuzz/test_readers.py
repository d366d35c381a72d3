"""Readers of foreign bytes meet damaged ones: the corpus, changed at random and by a fuzzer."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fuzz.readers import CORPUS, READERS

from handeye_cli.errors import HandeyeError

MUTANTS = 40
"""Damaged copies of each file of the corpus."""
SECONDS = 5
"""For which a fuzzer looks at each reader."""
EXPLORED = ("mcap", "payloads", "yaml", "image", "metadata")
INTERESTING = (
    b"\0", b"\xff", b"\xff\xff\xff\x7f", b"\0" * 8, b"\xff" * 8, b"[" * 200, b"9" * 5000, b"-.inf",
    b"1e999", b"\xef\xbb\xbf", b"!!python/object:x ", b"<!DOCTYPE a>",
)  # fmt: skip
"""What breaks lengths, numbers and parsers."""

FILES = [
    pytest.param(reader, path, id=f"{reader}-{path.name}")
    for reader in READERS
    for path in sorted((CORPUS / reader).iterdir())
]


def refused(reader, data):
    """Return whether a reader refuses bytes; anything but an error of bad input passes through."""
    try:
        READERS[reader](data)
    except HandeyeError:
        return True
    return False


@pytest.mark.parametrize("reader", READERS)
def test_no_bytes_at_all_and_nonsense(reader):
    refused(reader, b"")
    refused(reader, bytes(range(256)))


@pytest.mark.parametrize(("reader", "path"), FILES)
def test_the_corpus_is_read_damaged_or_not(impatient, reader, path):
    good = path.read_bytes()
    refused(reader, good)
    rng = np.random.default_rng(len(good))
    for _ in range(MUTANTS):
        refused(reader, damaged(good, rng))


def damaged(data, rng):
    """Cut, repeat, overwrite or flip one to three places."""
    for _ in range(rng.integers(1, 4)):
        start, stop = sorted(rng.integers(0, len(data) + 1, 2))
        piece = INTERESTING[rng.integers(len(INTERESTING))]
        flipped = bytes([data[start] ^ (1 << rng.integers(8))]) if start < len(data) else b""
        data = (
            data[:start],
            data[:stop] + data[start:],
            data[:start] + piece + data[start + len(piece) :],
            data[:start] + piece + data[start:],
            data[:start] + flipped + data[start + 1 :],
        )[rng.integers(5)]
    return data


@pytest.mark.skipif(
    importlib.util.find_spec("atheris") is None, reason="atheris is not here (the extra `fuzz`)"
)
@pytest.mark.parametrize("reader", EXPLORED)
def test_a_fuzzer_finds_nothing(tmp_path, reader):
    fresh = tmp_path / "found"
    fresh.mkdir()
    tests = str(Path(__file__).parents[1])
    path = os.pathsep.join([tests, *filter(None, [os.environ.get("PYTHONPATH")])])
    flags = [f"-max_total_time={SECONDS}", "-rss_limit_mb=2048", "-timeout=10", "-verbosity=0"]
    done = subprocess.run(
        [sys.executable, "-m", "fuzz.explore", reader, fresh, CORPUS / reader, *flags, "-seed=1"],
        capture_output=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:].decode(errors="replace")
