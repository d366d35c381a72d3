"""Documents come together by the digests of what they were made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reporting.cases import calibration, left_out, shot, stations, verification

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import Plan, ProvenanceStep
from handeye_cli.records.batch import Batch, BatchRow
from handeye_cli.records.truth import Truth
from handeye_cli.reporting.case import Read
from handeye_cli.reporting.gathering import gather


def read(name, record, *inputs, before=None, asked=True):
    """A file whose digest is its name in capitals, made from others."""
    steps = () if before is None else before.record.provenance
    if inputs:
        files = tuple((each, each.upper()) for each in inputs)
        steps = (*steps, ProvenanceStep("step", "1", files))
    return Read(name, name.upper(), replace(record, provenance=steps), asked)


FEATURES = read("features", shot().features, "recording")
STATIONS = read("stations", stations(), "features", before=FEATURES)
ANSWER = read("answer", calibration(), "stations", before=STATIONS)
CHECK = read("check", verification(), "stations", before=STATIONS)


def test_the_documents_of_one_recording_are_one_case():
    (case,) = gather([CHECK, FEATURES, ANSWER, STATIONS])
    assert case.calibration is ANSWER.record
    assert case.features is FEATURES.record
    assert case.stations is STATIONS.record
    assert case.verifications == (CHECK.record,)
    assert case.name == "answer"
    assert sorted(case.files) == [(name, name.upper()) for name in
                                  ("answer", "check", "features", "stations")]  # fmt: skip


def test_a_file_in_the_middle_that_was_not_given_parts_nothing():
    (case,) = gather([FEATURES, ANSWER])
    assert case.features is FEATURES.record
    assert case.calibration is ANSWER.record


def test_documents_without_history_stand_alone():
    other = read("other", stations())
    cases = gather([other, ANSWER])
    assert [case.name for case in cases] == ["other", "answer"]
    assert cases[0].stations is other.record
    assert cases[1].stations is None


def test_two_answers_are_two_cases_each_with_what_it_was_made_from():
    features = read("refined", shot().features, "recording")
    refined = read("refined-stations", stations(), "refined", before=features)
    second = read("second", calibration(), "refined-stations", before=refined)
    both = read("both", left_out(), "recording")
    cases = gather([ANSWER, second, STATIONS, refined, both])
    assert [case.name for case in cases] == ["answer", "second"]
    assert cases[0].stations is STATIONS.record
    assert cases[1].stations is refined.record
    assert [case.verifications for case in cases] == [(both.record,), (both.record,)]


def test_an_answer_checked_on_new_stations_brings_them_along():
    new = read("new", stations())
    check = read("check", verification(), "new", "answer")
    (case,) = gather([check, ANSWER, new])
    assert case.calibration is ANSWER.record
    assert case.verifications == (check.record,)


def test_all_verifications_of_an_answer_are_kept_in_order():
    second = read("second", left_out(), "stations", before=STATIONS)
    (case,) = gather([ANSWER, CHECK, second])
    assert case.verifications == (CHECK.record, second.record)


def test_a_plan_made_from_an_answer_stands_beside_it():
    plan = read("plan", Plan(calibration().setup, (), ()), "answer", before=ANSWER)
    (case,) = gather([plan, ANSWER])
    assert case.plans == (plan.record,)


def test_what_nobody_asked_for_does_not_make_a_case():
    stray = Read("stray", "STRAY", stations(), asked=False)
    assert [case.name for case in gather([stray, ANSWER])] == ["answer"]


def test_two_documents_for_one_place_are_refused():
    twin = Read("twin", "TWIN", FEATURES.record)
    with pytest.raises(UsageError, match=r"expected one features document .*features, twin"):
        gather([FEATURES, twin])


def test_a_late_file_joins_groups_that_were_apart():
    early = read("a", stations(), "x")
    other = read("b", left_out(), "y")
    joint = read("c", calibration(), "a", "b")
    (case,) = gather([early, other, joint])
    assert case.stations is early.record
    assert case.verifications == (other.record,)


def test_recordings_made_from_one_plan_have_nothing_in_common():
    made = ProvenanceStep("simulate recording", "1", (("plan", "PLAN"),))
    one, other = (
        Read(name, name.upper(), replace(
            stations(),
            provenance=(made, ProvenanceStep("extract", "1", ((name[0], name[0]),))),
        ))
        for name in ("a.yaml", "b.yaml")
    )  # fmt: skip
    assert one.root == "a"
    assert [case.name for case in gather([one, other])] == ["a.yaml", "b.yaml"]


def test_a_document_that_no_page_shows_is_refused_when_asked_for():
    pose = np.eye(4)
    truth = read("truth.yaml", Truth(Setup.EYE_IN_HAND, pose, pose, (), 0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"truth\.yaml.*found a truth document"):
        gather([ANSWER, truth])
    (case,) = gather([ANSWER, replace(truth, asked=False)])
    assert case.name == "answer"


def test_a_batch_is_a_case_of_its_own():
    batch = read("tonight", Batch((BatchRow("a.mcap"),)))
    cases = gather([ANSWER, batch])
    assert [(each.name, len(each.batches)) for each in cases] == [("answer", 0), ("tonight", 1)]
