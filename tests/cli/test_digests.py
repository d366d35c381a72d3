"""Digests that are computed beside other work."""

import hashlib
import os
import time

import pytest

from handeye_cli.cli.digests import digesting
from handeye_cli.errors import InputError


def test_digests_are_those_of_the_files_one_behind_the_other(tmp_path):
    contents = [b"", b"a" * 3_000_001, b"bc"]
    files = [tmp_path / str(k) for k in range(len(contents))]
    for file, content in zip(files, contents, strict=True):
        file.write_bytes(content)
    inputs = [[str(files[1])], [], [str(file) for file in files]]
    with digesting(inputs) as digests:
        found = digests.result()
    wanted = [contents[1], b"", b"".join(contents)]
    assert found == [hashlib.sha256(each).hexdigest() for each in wanted]


def test_nothing_is_hashed_on_when_the_other_work_fails(tmp_path):
    """A file of zeros that takes minutes to hash."""
    endless = tmp_path / "endless"
    with endless.open("wb") as file:
        file.truncate(2**37)
    start = time.monotonic()
    with pytest.raises(KeyError), digesting([[str(endless)]]):
        raise KeyError
    assert time.monotonic() - start < 5.0


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (
        pytest.raises(InputError, match="expected a file, found none") as caught,
        digesting([[str(tmp_path / "pipe")]]) as digests,
    ):
        digests.result(timeout=5.0)
    assert caught.value.where == str(tmp_path / "pipe")


def test_digests_that_nobody_asks_for_do_no_harm(tmp_path):
    with digesting([[str(tmp_path / "none")]]):
        pass


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unreadable for root")
def test_a_file_that_may_not_be_read(tmp_path):
    (tmp_path / "secret").touch(mode=0)
    with (
        pytest.raises(InputError, match="cannot read it: Permission denied"),
        digesting([[str(tmp_path / "secret")]]) as digests,
    ):
        digests.result()
