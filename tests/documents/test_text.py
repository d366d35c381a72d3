"""The YAML and JSON reader: its scalars, its bounds and its complaints."""

from __future__ import annotations

import json
import math
from decimal import Decimal

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handeye_cli.documents import text
from handeye_cli.errors import InputError


@pytest.fixture(params=["libyaml", "python"])
def parse(request, monkeypatch):
    """The reader on each of PyYAML's parsers, so that both give the same."""
    if request.param == "libyaml" and not yaml.__with_libyaml__:
        pytest.skip("PyYAML was built without libyaml")
    monkeypatch.setattr(yaml, "__with_libyaml__", request.param == "libyaml")
    return lambda content: text.parse(
        content if isinstance(content, bytes) else content.encode(), "f"
    )


SCALARS = [
    ("1", 1),
    ("010", 10),
    ("-7", -7),
    ("1e-05", 1e-5),
    ("1e3", 1000.0),
    ("1.", 1.0),
    (".5", 0.5),
    ("+0.5E+2", 50.0),
    ("-.inf", -math.inf),
    ("99999999999999999999", 1e20),
    ("1_000", "1_000"),
    ("12:30:45", "12:30:45"),
    ("0x10", "0x10"),
    ("0o7", "0o7"),
    ("2024-01-01", "2024-01-01"),
    ("1e", "1e"),
    ("-", None),
    ("no", "no"),
    ("Yes", "Yes"),
    ("on", "on"),
    ("true", True),
    ("False", False),
    ("TRUE", True),
    ("tRUE", "tRUE"),
    ("null", None),
    ("~", None),
    ("", None),
    ("'1'", "1"),
    ('"true"', "true"),
    ("!!str 12", "12"),
]


@pytest.mark.parametrize(("written", "meant"), [pair for pair in SCALARS if pair[0] != "-"])
def test_scalars_follow_yaml_1_2(parse, written, meant):
    value = parse(f"key: {written}")["key"]
    assert (type(value), value) == (type(meant), meant)


def test_not_a_number_is_read_as_one_for_the_schema_to_refuse(parse):
    assert math.isnan(parse("key: .nan")["key"])


def test_names_stay_as_written(parse):
    assert parse("- {name: 00}\n- {name: 1e3}\n- {name: no, other: 00}") == [
        {"name": "00"},
        {"name": "1e3"},
        {"name": "no", "other": 0},
    ]


def test_unit_suffixed_numbers_keep_their_digits(parse):
    data = parse(
        "{a_mrad: 0.8100000000000000123, a_ms: 4.1000000000000000123, b_mm: 2, c_mm: .inf, "
        "d_mm: 1e-999, e: 0.1}"
    )
    assert data["a_mrad"] == Decimal("0.8100000000000000123")
    assert data["a_ms"] == Decimal("4.1000000000000000123")
    assert type(data["b_mm"]) is int
    assert type(data["c_mm"]) is type(data["d_mm"]) is type(data["e"]) is float


def test_anchors_and_aliases_repeat_values(parse):
    assert parse("a: &x [1, {b: &y 2}]\nc: *x\nd: *y") == {
        "a": [1, {"b": 2}],
        "c": [1, {"b": 2}],
        "d": 2,
    }


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_byte_order_marks_are_understood(parse, encoding):
    assert parse("grad: 1°\r\n".encode(encoding)) == {"grad": "1°"}


def test_depth_is_bounded_but_generous(parse):
    deepest = text.MAX_DEPTH
    assert parse("[" * deepest + "]" * deepest)
    with pytest.raises(InputError, match="at most 60 levels") as caught:
        parse("[" * 100_000)
    assert caught.value.where == "f, line 1, column 61"


def test_an_expansion_bomb_is_refused(parse):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    with pytest.raises(InputError, match="aliases for at most 100000 values"):
        parse("\n".join(lines))


def nested(name, value, levels):
    return f"{name}: &{name} {'[' * levels}{value}{']' * levels}"


def test_aliases_do_not_nest_deeper_than_what_is_written(parse):
    """Each level of the text may hold an alias of the one before: few values, but a deep tree."""
    levels = text.MAX_DEPTH // 2
    within = f"{nested('a', '1', levels)}\n{nested('b', '*a', levels - 1)}"
    assert str(parse(within)["b"]) == f"{'[' * (2 * levels - 1)}1{']' * (2 * levels - 1)}"
    with pytest.raises(InputError, match="at most 60 levels of nesting") as caught:
        parse(f"{within}\nc: [*b]")
    assert caught.value.where == "f, line 3, column 5"


def test_a_chain_of_deep_aliases_is_refused(parse):
    links = [nested(f"a{k}", f"*a{k - 1}", 50) for k in range(1, 40)]
    with pytest.raises(InputError, match="at most 60 levels of nesting") as caught:
        parse("\n".join([nested("a0", "1", 50), *links]))
    assert caught.value.where.startswith("f, line 2, ")


def test_size_is_bounded(monkeypatch):
    monkeypatch.setattr(text, "MAX_BYTES", 3_000_000)
    with pytest.raises(InputError, match="at most 3 MB, found more"):
        text.parse(b" " * 5_000_000, "f")


FAULTS = [
    ("", "found nothing", "f"),
    ("# a comment", "found nothing", "f"),
    ("a: 1\nb: 2\na: 3", "the key 'a' was given before, in line 1", "f, line 3, column 1"),
    ('{"a": {"b": 1, "b": 2}}', "the key 'b' was given before", "f, line 1, column 16"),
    ("a: !!python/object/apply:os.system ls", "os.system", "f, line 1, column 4"),
    ("a: !mine [1]", "the tag '!mine'", "f, line 1, column 4"),
    ("a: &x [*x]", "the alias [*]x stands for nothing", "f, line 1, column 8"),
    ("a: 1\n---\nb: 2", "expected one document", "f, line 2, column 1"),
    ("? [1]\n: 2", "expected a text as key", "f, line 1, column 3"),
    ("a: &x b\n*x : c", "found an alias", "f, line 2, column 1"),
    ("a: [1\nb: 2", "not valid YAML or JSON", "f, line 2, column 2"),
    ("a: 'b", "not valid YAML or JSON", "f, line 1, column"),
    (b"a: 1\nb: \xff", "found the byte 0xff", "f, line 2"),
    ("a: \x07", "not valid YAML or JSON", "f"),
    ("a: 1\nb: \x00", "found a zero byte", "f, line 2"),
]


@pytest.mark.parametrize(("content", "message", "where"), FAULTS)
def test_faults_are_named_with_their_place(parse, content, message, where):
    with pytest.raises(InputError, match=message) as caught:
        parse(content)
    assert caught.value.where.startswith(where)


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**17), 10**17)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs", "Cc"]), max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text("ab-c", max_size=4), inner),
    max_leaves=20,
)


@settings(suppress_health_check=[HealthCheck.too_slow])  # as it may be on a busy machine
@given(JSON)
def test_json_means_what_it_means_to_a_json_reader(data):
    content = json.dumps(data)
    assert text.parse(content.encode(), "f") == json.loads(content)
