"""The page that explains all findings has all of them."""

import re
from pathlib import Path

import pytest
import yaml

from docs import finding_codes
from handeye_cli import documents
from handeye_cli.chain import chain_of
from handeye_cli.diagnosis import hypotheses, pairings
from handeye_cli.diagnosis.readings import reading_of

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "troubleshooting.md").read_text("utf-8")

_HANDED_ON = {
    "code",  # of `_as_finding` and `_try`, whose own callers are looked at
    "item['code']",  # read from a document that some command has written
    "best.hypothesis.code",  # of the table of hypotheses, which another test goes through
}
_MESSAGES_HANDED_ON = {
    "'; '.join(errors)",  # findings, by inspect
    "finding.message",  # the same, by solve
    "error.message",  # with a station's name added
    "f'{start} {cell.in_words(column, excess)}'",  # a plan's limits, checked below by their words
}


def test_every_code_in_the_source_is_explained() -> None:
    codes, handed_on = finding_codes.codes()
    assert len(codes) > 50
    assert sorted(code for code in codes if f"`{code}`" not in PAGE) == []
    assert handed_on == _HANDED_ON


@pytest.mark.parametrize("degrees", [True, False])
@pytest.mark.parametrize("setup", ["eye-in-hand", "eye-to-hand"])
def test_every_reading_of_the_conventions_is_explained(
    degrees: bool, setup: str, tmp_path: Path
) -> None:
    turn = 57.3 if degrees else 1.0
    stations = [
        {
            "base_T_gripper": {
                "translation": [0.1 * k, 0.2, 0.3],
                "euler": [0.1 * k * turn, 0.2 * turn, 0.03 * k * k * turn],
                "order": "xyz",
                "degrees": degrees,
            },
            "camera_T_target": {"translation": [0, 0.01 * k, 0.5], "quaternion": [0, 0, 0, 1]},
        }
        for k in range(7)
    ]
    path = tmp_path / "stations.yaml"
    data = {"schema": "handeye/stations/1", "setup": setup, "stations": stations}
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    read = documents.read(str(path))
    reading = reading_of(read, chain_of(read), 60)
    rows = [*hypotheses.conventions(reading), *pairings.pairings(reading)]
    codes = {row.code.removesuffix("-and-direction") for row in rows}
    assert {"mounting-or-direction", "lists-shifted", "euler-order"} <= codes
    assert sorted(code for code in codes if f"`{code}`" not in PAGE) == []


@pytest.mark.parametrize("error", ["UndeterminedError", "ConvergenceError"])
def test_every_message_of_exit_codes_4_and_5_is_explained(error: str) -> None:
    pieces, handed_on = finding_codes.messages(error)
    assert len(pieces) > 5
    assert sorted(piece for piece in pieces if piece not in PAGE) == []
    assert handed_on <= _MESSAGES_HANDED_ON


def test_limits_of_a_plan_are_explained_in_its_words() -> None:
    source = (finding_codes.PACKAGE / "planning" / "settle.py").read_text("utf-8")
    assert ": no place keeps the limit " in source
    assert ": no place keeps the limit " in PAGE


def test_the_page_explains_nothing_that_is_not_there() -> None:
    source = "\n".join(finding_codes.sources().values())
    firsts = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    told = set(re.findall(r"`([a-z0-9]+(?:-[a-z0-9]+)+)`", " ".join(firsts)))
    composed = {"euler-order-and-degrees-as-radians", "euler-order-and-radians-as-degrees"}
    assert len(told) > 50
    assert sorted(code for code in told - composed if f'"{code}' not in source) == []
