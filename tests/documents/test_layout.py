"""The YAML and JSON writer, read back by other readers."""

from __future__ import annotations

import json
import math
from decimal import Decimal

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from handeye_cli.documents import layout, text

DATA = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**17), 10**17)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
    | st.sampled_from(["no", "Null", "1e5", "0x1", ".inf", "=", "<<", "a: b", "- a", "a #b", "~"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("ab: -1", min_size=1, max_size=4), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(st.dictionaries(st.text("ab: -1", min_size=1, max_size=4), DATA, max_size=4))
def test_written_data_are_read_back_by_every_reader(data):
    as_yaml, as_json = layout.dump(data, "yaml"), layout.dump(data, "json")
    assert text.parse(as_yaml.encode(), "f") == data
    assert text.parse(as_json.encode(), "f") == data
    assert json.loads(as_json) == data
    # a reader of YAML 1.1, which takes more words for booleans and fewer for numbers
    assert yaml.safe_load(as_yaml) == data


def test_yaml_is_laid_out_for_people():
    data = {
        "schema": "handeye/plan/1",
        "name": "00",
        "tiny": 1e-5,
        "ok": True,
        "nothing": None,
        "none": [],
        "matrix": np.eye(2),
        "stations": [{"ids": (1, np.int64(2)), "text": "31 of 36: lost"}, {"pose": {"t": [0.5]}}],
    }
    assert layout.dump(data, "yaml") == (
        "schema: handeye/plan/1\n"
        'name: "00"\n'
        "tiny: 1.0e-05\n"
        "ok: true\n"
        "nothing: null\n"
        "none: []\n"
        "matrix:\n"
        "  - [1.0, 0.0]\n"
        "  - [0.0, 1.0]\n"
        "stations:\n"
        "  - ids: [1, 2]\n"
        '    text: "31 of 36: lost"\n'
        "  - pose:\n"
        "      t: [0.5]\n"
    )


def test_json_keeps_lists_of_scalars_on_one_line():
    data = {"a": [1, 2.5], "b": [[1], [2]], "c": {}, "d": [{"e": "°"}]}
    assert layout.dump(data, "json") == (
        '{\n  "a": [1, 2.5],\n  "b": [\n    [1],\n    [2]\n  ],\n  "c": {},\n'
        '  "d": [\n    {\n      "e": "°"\n    }\n  ]\n}\n'
    )


@pytest.mark.parametrize(
    ("number", "written"),
    [
        (np.float64(0.1), "0.1"),
        (1e22, "1.0e+22"),
        (2.5e-7, "2.5e-07"),
        (Decimal("0.81"), "0.81"),
        (Decimal("1E+3"), "1000.0"),
        (Decimal("0.12345678901234567890"), "0.12345678901234567890"),
        (Decimal("1.2345678901234567890e-9"), "1.2345678901234567890e-9"),
    ],
)
def test_numbers_are_written_with_the_fewest_digits_that_tell_them(number, written):
    assert layout.dump({"x": number}, "yaml") == f"x: {written}\n"


def test_numpy_values_become_plain_ones():
    data = {"a": np.bool_(True), "b": np.array([1, 2]), "c": np.str_("x"), "d": [np.float32(0.5)]}
    assert json.loads(layout.dump(data, "json")) == {"a": True, "b": [1, 2], "c": "x", "d": [0.5]}


def test_a_file_name_that_is_not_unicode_does_not_break_the_document():
    written = layout.dump({"file": "caf\udce9.png"}, "yaml").encode("utf-8")
    assert text.parse(written, "f") == {"file": "caf?.png"}


@pytest.mark.parametrize("value", [math.nan, -math.inf, Decimal("Infinity")])
def test_numbers_that_are_not_finite_are_refused(value):
    with pytest.raises(ValueError, match="cannot hold the number"):
        layout.dump({"x": [value]}, "json")


def test_other_types_are_refused():
    with pytest.raises(TypeError, match="complex"):
        layout.dump({"x": 1j}, "yaml")
