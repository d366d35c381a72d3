"""The limits of a verification, and data that an answer can rest on."""

import math

import pytest

from handeye_cli import gates
from handeye_cli.conventions import Setup
from handeye_cli.errors import QualityGateError, UndeterminedError
from handeye_cli.gates import Limits
from handeye_cli.records import Finding, Inspection, Verification, VerificationRow

EYE = Setup.EYE_IN_HAND


def verification(consistent):
    rows = (
        VerificationRow(4, 4.5e-3, 0.5e-3, None, None, None, ()),
        VerificationRow(6, 3.5e-3, 0.7e-3, 1e-3, 1e-4, consistent, ()),
    )
    return Verification(EYE, "tsai-lenz", rows)


@pytest.mark.parametrize(
    ("limits", "messages"),
    [
        (
            Limits(rotation_mrad=4),
            ["4 stations: expected a rotation error up to 4 mrad, found 4.5"],
        ),
        (
            Limits(translation_mm=0.6),
            ["6 stations: expected a translation error up to 0.6 mm, fou"],
        ),
        (
            Limits(consistent=True),
            [
                "6 stations: the errors contradict the prediction: expected about 1.000 mrad and "
                "0.100 mm, found 3.500 mrad and 0.700 mm"
            ],
        ),
        (Limits(rotation_mrad=math.nan), ["expected a rotation error up to nan mrad, found 4.500"]),
        (Limits(rotation_mrad=1), ["found 4.500; calibrated on 6", "found 3.500"]),
    ],
)
def test_every_row_over_a_limit_is_named(limits, messages):
    with pytest.raises(QualityGateError) as caught:
        gates.check_limits(verification(consistent=False), limits)
    for message in messages:
        assert message in str(caught.value)


@pytest.mark.parametrize(
    ("limits", "hint"),
    [(Limits(consistent=True), True), (Limits(rotation_mrad=1), False)],
)
def test_a_contradiction_is_told_with_what_to_look_at(limits, hint):
    with pytest.raises(QualityGateError) as caught:
        gates.check_limits(verification(consistent=False), limits)
    assert (caught.value.hint is not None) == hint
    if hint:
        assert "largest errors" in caught.value.hint


@pytest.mark.parametrize("consistent", [True, None])
def test_limits_that_are_kept(consistent):
    limits = Limits(rotation_mrad=4.5, translation_mm=0.7, consistent=True)
    gates.check_limits(verification(consistent), limits)


def test_no_limits_keep_everything():
    gates.check_limits(verification(consistent=False), Limits())


def test_every_error_of_an_inspection_is_told_with_the_first_advice():
    findings = (
        Finding("pose-units", "error", "a thousand times", "write metres"),
        Finding("bad-station", "warning", "station 03", "look at it"),
        Finding("not-determined", "error", "one axis"),
    )
    with pytest.raises(UndeterminedError, match=r"^a thousand times; one axis ") as caught:
        gates.require_meaning(Inspection(EYE, (), findings))
    assert caught.value.hint == "write metres"


def test_warnings_leave_an_answer_its_meaning():
    gates.require_meaning(Inspection(EYE, (), (Finding("bad-station", "warning", "03"),)))
