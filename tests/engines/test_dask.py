"""Jobs on a cluster, here one in this process."""

import sys

import pytest
from engines.labours import by_word

from handeye_cli.engines import engine_of
from handeye_cli.errors import InputError, UsageError


def test_without_the_extra_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match="not installed") as caught:
        engine_of("dask", "tcp://127.0.0.1:8786")
    assert "handeye-cli[cluster]" in caught.value.hint


def test_an_address_that_is_none():
    pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with pytest.raises(InputError, match="'foo'") as caught:
        next(engine_of("dask", "foo://bar").run(by_word, ["a"]))
    assert caught.value.where == "--scheduler foo://bar"


def test_nobody_at_an_address(monkeypatch):
    pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    monkeypatch.setattr("handeye_cli.engines.dask._PATIENCE", "200ms")
    with pytest.raises(InputError, match="found none that answers"):
        next(engine_of("dask", "tcp://127.0.0.1:1").run(by_word, ["a"]))


def test_each_job_ends_once_and_a_fault_is_its_own(cluster):
    found = sorted(
        engine_of("dask", cluster).run(by_word, ["a", "raise", "a", "b"]),
        key=lambda each: each.index,
    )
    assert [each.index for each in found] == [0, 1, 2, 3]
    assert [each.result for each in found] == ["aa", None, "aa", "bb"]
    assert isinstance(found[1].fault, KeyError)
