"""The traffic light: worst first, with its reasons."""

from __future__ import annotations

from dataclasses import replace

import pytest
from reporting.cases import calibration, finding, left_out, verification

from handeye_cli.conventions import Setup
from handeye_cli.errors import ConvergenceError
from handeye_cli.gates import Limits
from handeye_cli.records import Inspection, PredictedError
from handeye_cli.records.batch import Batch, BatchRow, BatchStatus
from handeye_cli.reporting.batch_light import row_lights
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.colour import Colour
from handeye_cli.reporting.light import NOT_VERIFIED, broken_limits, judge, nearest_row

NONE = Limits()
OK = BatchStatus.OK


def case(*findings, verifications=(), **others):
    answer = replace(
        calibration(),
        diagnosis=findings,
        predicted_error=PredictedError(0.8e-3, 0.2e-3, 1.3e-3, 0.3e-3),
    )
    return Case("a", calibration=answer, verifications=verifications, **others)


def test_an_answer_that_nobody_checked_is_green_and_says_so():
    light = judge(case(finding("info", "by the way")), NONE)
    assert light.colour is Colour.GREEN
    assert not light.verified
    assert NOT_VERIFIED in light.reasons


def test_a_checked_answer_is_green():
    light = judge(case(verifications=(verification(),)), NONE)
    assert light.colour is Colour.GREEN
    assert light.verified
    assert "as predicted" in light.reasons[-1]


def test_errors_that_nothing_predicts_speak_neither_for_nor_against():
    light = judge(case(verifications=(verification(consistent=None),)), NONE)
    assert light.colour is Colour.GREEN
    assert "nothing that predicts them" in light.reasons[-1]


def test_warnings_make_amber_and_are_the_reasons():
    found = (finding("warning", "the plate is bowed"), finding("info", "fine"))
    light = judge(case(*found), NONE)
    assert light.colour is Colour.AMBER
    assert light.reasons == ("the plate is bowed",)


def test_an_error_makes_red_whatever_else_there_is():
    found = (finding("warning", "bowed"), finding("error", "poses are inverted"))
    light = judge(case(*found, verifications=(verification(),)), NONE)
    assert light.colour is Colour.RED
    assert light.reasons == ("poses are inverted",)


@pytest.mark.parametrize("row", [verification(consistent=False), replace(
    left_out(), rows=(replace(left_out().rows[0], consistent=False),))])  # fmt: skip
def test_a_contradicted_prediction_makes_red(row):
    light = judge(case(finding("warning", "w"), verifications=(verification(), row)), NONE)
    assert light.colour is Colour.RED
    (reason,) = light.reasons
    assert "1.000 mrad" in reason
    assert "1.100 mrad" in reason
    assert "beyond chance" in reason
    assert "look at the stations with the largest errors" in reason


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (Limits(rotation_mrad=0.5), ["predicted rotation", "0.5 mrad", "0.800"]),
        (Limits(translation_mm=0.1), ["predicted translation", "0.1 mm", "0.200"]),
    ],
)
def test_a_predicted_error_above_its_limit_makes_red(limits, words):
    light = judge(case(), limits)
    assert light.colour is Colour.RED
    assert all(word in light.reasons[0] for word in words)
    assert light.reasons == broken_limits(case(), limits)


def test_a_seen_error_above_its_limit_makes_red():
    light = judge(case(verifications=(verification(),)), Limits(rotation_mrad=0.9))
    assert light.colour is Colour.RED
    assert "up to 0.9 mrad, found 1.000" in light.reasons[0]


def test_limits_that_are_kept_change_nothing():
    assert judge(case(), Limits(0.8001, 0.2001)).colour is Colour.GREEN


def test_an_answer_that_was_looked_for_in_vain_makes_red():
    light = judge(
        Case("a", inspection=Inspection(Setup.EYE_IN_HAND, ()), failure=ConvergenceError("lost")),
        NONE,
    )
    assert light.colour is Colour.RED
    assert light.reasons == ("lost",)


def test_findings_of_all_documents_count_once_the_gravest_first():
    shared = finding("warning", "same")
    both = case(shared, inspection=Inspection(
        Setup.EYE_IN_HAND, (), diagnosis=(shared, finding("error", "worse"))))  # fmt: skip
    assert [each.message for each in both.findings] == ["worse", "same"]


def test_nothing_to_judge_has_no_light():
    assert judge(Case("a"), NONE) is None


def test_the_nearest_row_calibrates_on_most_stations():
    _, row = nearest_row(case(verifications=(left_out(), verification(count=5))))
    assert row.stations == left_out().rows[0].stations
    assert nearest_row(case()) is None


def test_errors_no_larger_than_expected_can_be_spread_beyond_chance():
    quiet = verification(consistent=False, rotation=1e-3)
    (reason,) = judge(case(verifications=(quiet,)), NONE).reasons
    assert "1.000 mrad" in reason
    assert "no larger than the 1.100 mrad" in reason
    loud = verification(consistent=False, rotation=1.2e-3)
    (reason,) = judge(case(verifications=(loud,)), NONE).reasons
    assert "1.200 mrad and 0.100 mm RMS where 1.100 mrad" in reason


def test_a_recording_that_was_only_looked_into_has_no_light():
    assert judge(Case("a", inspection=Inspection(None, ())), NONE) is None
    unread = Inspection(None, (), diagnosis=(finding("error", "no images"),))
    light = judge(Case("a", inspection=unread), NONE)
    assert light.colour is Colour.RED
    assert light.reasons == ("no images",)


def rows(*statuses):
    return Batch(tuple(BatchRow(f"{i}.mcap", status) for i, status in enumerate(statuses)))


@pytest.mark.parametrize(
    ("statuses", "colour", "words"),
    [
        ((OK, OK), Colour.GREEN, "any of the 2 recordings"),
        ((OK, BatchStatus.WARNINGS), Colour.AMBER, "to be looked at: 1 of 2: 1.mcap"),
        ((OK, BatchStatus.CANCELLED), Colour.AMBER, "interrupted: 1 of 2: 1.mcap"),
        ((BatchStatus.WARNINGS, BatchStatus.GATE), Colour.RED, "limit was missed: 1 of 2: 1.mcap"),
        ((BatchStatus.FAILED,) * 7, Colour.RED, "7 of 7: 0.mcap, 1.mcap, 2.mcap, 3.mcap, 4.mcap "
         "and 2 more"),
    ],
)  # fmt: skip
def test_a_batch_is_as_good_as_the_worst_of_its_recordings(statuses, colour, words):
    light = judge(Case("batch.yaml", batches=(rows(*statuses),)), NONE)
    assert light.colour is colour
    assert words in light.reasons[0]
    assert not light.verified


def test_recordings_above_a_limit_of_the_report_are_red_and_stand_on_top():
    near, far = (
        BatchRow("near", predicted_translation=1e-3, seen_translation=1e-3),
        BatchRow("far", BatchStatus.WARNINGS, predicted_translation=3e-3, seen_translation=4e-3),
    )
    batch, limits = Batch((near, far)), Limits(translation_mm=2.0)
    lights = row_lights(batch, limits)
    assert [(each.row.name, each.colour) for each in lights] == [
        ("far", Colour.RED),
        ("near", Colour.GREEN),
    ]
    assert broken_limits(Case("batch.yaml", batches=(batch,)), limits) == (
        "far: expected a predicted translation error up to 2 mm, found 3.000",
        "far: expected a seen translation error up to 2 mm, found 4.000",
    )
