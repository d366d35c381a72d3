"""Documents with faults that nobody has thought of: one clear error, or a result; never a crash."""

from __future__ import annotations

import json

import numpy as np
import pytest
from documents import samples
from fuzz.mutations import mutated
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from line.good_input import documents_of_the_line, write

from handeye_cli import documents
from handeye_cli.documents.text import MAX_DEPTH, parse
from handeye_cli.errors import InputError

COMMANDS = {
    "features": [["extrinsics"], ["inspect"], ["solve", "--method", "tsai-lenz"]],
    "stations": [["solve"], ["solve", "--partial"], ["solve", "--method", "daniilidis"], ["verify"],
                 ["inspect"], ["export", "--to", "kalibr"]],
    "calibration": [["export", "--to", "matrix-csv"], ["export", "--to", "opencv"]],
}  # fmt: skip
"""What is done with the documents of a kind."""
STATIONS, FEATURES = 5, 4
BOUNDED = settings(
    derandomize=True, deadline=None, database=None,
    suppress_health_check=list(HealthCheck), max_examples=15,
)  # fmt: skip


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    """A small document of every kind, as plain data."""
    folder = tmp_path_factory.mktemp("kinds")
    every = {
        name: json.loads(documents.dump(record, "json"))
        for name, record in samples.records(np.random.default_rng(5), folder).items()
    }
    return every | small()


def small():
    good = documents_of_the_line()
    for name, count in (("features", FEATURES), ("stations", STATIONS), ("recording", 3)):
        good[name]["stations"] = good[name]["stations"][:count]
    return good


@given(data=st.data())
@settings(BOUNDED, max_examples=60)
def test_reading_gives_a_record_or_says_what_is_wrong(kinds, tmp_path_factory, data):
    name = data.draw(st.sampled_from(sorted(kinds)))
    path = tmp_path_factory.getbasetemp() / "read.json"
    write(path, data.draw(mutated(kinds[name])))
    record, error = outcome(lambda: documents.read(str(path)))
    if error is None:
        # what was accepted can be written, and is accepted again
        write(path, json.loads(documents.dump(record, "json")))
        documents.read(str(path))
    else:
        assert str(path) in error.where
        assert error.message


def outcome(call):
    """Return what a call returns, and the error that it raises when it is one of bad input."""
    try:
        return call(), None
    except InputError as error:
        return None, error


@pytest.mark.parametrize("kind", COMMANDS)
@given(data=st.data())
@BOUNDED
def test_a_command_gives_a_result_or_one_error(handeye, kinds, tmp_path, kind, data):
    words = data.draw(st.sampled_from(COMMANDS[kind]))
    file = write(tmp_path / "in.json", data.draw(mutated(kinds[kind])))
    done = handeye(words[0], file, *words[1:], "-o", "-")
    assert done.code in range(7), done.err
    assert done.code != 1, done.err
    assert "Traceback" not in done.err
    told = [line for line in done.err.splitlines() if line.startswith("error:")]
    if done.code and words[0] != "inspect":  # an inspection's findings can be errors themselves
        assert len(told) == 1, done.err
        assert done.out == ""
    assert [path.name for path in tmp_path.iterdir()] == ["in.json"]


@given(st.binary(max_size=300))
@settings(BOUNDED, max_examples=100)
def test_any_bytes_are_plain_data_or_an_error_with_a_place(content):
    _, error = outcome(lambda: parse(content, "some.yaml"))
    assert error is None or error.where.startswith("some.yaml")


INDICATORS = st.text("[]{}-?:,#&*!|>'\"%@`~ \n\ta10.e", max_size=60)


@given(INDICATORS)
@settings(BOUNDED, max_examples=150)
def test_any_indicators_are_plain_data_or_an_error(text):
    value, _ = outcome(lambda: parse(text.encode(), "some.yaml"))
    assert depth_of(value) <= MAX_DEPTH


def depth_of(value):
    if not isinstance(value, list | dict):
        return 0
    inside = value.values() if isinstance(value, dict) else value
    return 1 + max(map(depth_of, inside), default=0)
