"""The stage of a batch: one recording, and whatever comes of it in one row."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli import pipeline
from handeye_cli.batch import Treatment, failed, outcome_of
from handeye_cli.errors import (
    ConvergenceError,
    HandeyeError,
    InputError,
    QualityGateError,
    UndeterminedError,
    UsageError,
)
from handeye_cli.gates import Limits
from handeye_cli.geometry import se3
from handeye_cli.records import Finding, Noise
from handeye_cli.records.batch import CANCELLED_CODE, Batch, BatchRow, BatchStatus

NOISE = Noise(2e-4, 1e-4, 2e-4, 1e-4)
TREATMENT = Treatment("maximum-likelihood")
SHA = "ab" * 32


def scene(count=12, seed=3):
    rng = np.random.default_rng(seed)
    return stations(rng, general_scene(rng, count), NOISE)


def outcome(record, treatment=TREATMENT):
    return outcome_of("cell", lambda: (record, SHA), treatment)


def test_the_row_says_what_solve_and_verify_say():
    record = scene()
    found = outcome(record)
    steps = pipeline.Steps()
    answer = pipeline.to_calibration(record, steps, method=TREATMENT.method, pairs="star")
    (line,) = pipeline.to_verification(
        record, steps, None, counts=None, method=TREATMENT.method, pairs="star"
    ).rows
    assert found.row == BatchRow(
        "cell",
        sha256=SHA,
        stations=12,
        used=12,
        predicted_rotation=answer.predicted_error.rotation,
        predicted_translation=answer.predicted_error.translation,
        seen_rotation=line.rotation,
        seen_translation=line.translation,
        consistent=True,
    )
    np.testing.assert_array_equal(
        found.calibration.mount_T_camera.matrix, answer.mount_T_camera.matrix
    )


def test_of_several_lines_the_one_on_most_stations_is_told():
    record = scene()
    several = outcome(record, replace(TREATMENT, counts=(6, 4))).row
    assert several.seen_translation == outcome(record).row.seen_translation
    fewest = outcome(record, replace(TREATMENT, counts=(4,))).row
    assert several.seen_translation != fewest.seen_translation


def test_an_existing_answer_is_verified_instead():
    answer = outcome(scene()).calibration
    other = replace(
        answer,
        mount_T_camera=replace(
            answer.mount_T_camera,
            matrix=answer.mount_T_camera.matrix @ se3.from_parts(np.eye(3), np.array([0.02, 0, 0])),
        ),
    )
    row = outcome(scene(), replace(TREATMENT, existing=other)).row
    # the plate stays where it was, and the camera is 20 mm beside where the answer has it
    assert row.seen_translation == pytest.approx(0.02, rel=0.6)
    assert (row.status, row.exit_code, row.consistent) == (BatchStatus.WARNINGS, 0, False)


def test_a_limit_that_is_missed_leaves_the_answer():
    found = outcome(scene(), replace(TREATMENT, limits=Limits(translation_mm=0.001)))
    assert (found.row.status, found.row.exit_code) == (BatchStatus.GATE, 6)
    seen = found.row.seen_translation * 1e3
    assert f"expected a translation error up to 0.001 mm, found {seen:.3f}" in found.row.message
    assert found.calibration is not None


def test_too_few_stations_to_verify_leave_the_answer():
    found = outcome(scene(5))
    assert (found.row.status, found.row.exit_code) == (BatchStatus.FAILED, 4)
    assert "expected at least 6 usable stations" in found.row.message
    assert "--leave-one-out" in found.row.advice
    assert (found.row.stations, found.row.used, found.row.seen_rotation) == (5, 5, None)
    assert found.calibration is not None
    assert outcome(scene(5), replace(TREATMENT, leave_one_out=True)).row.status is BatchStatus.OK


def test_a_contradiction_ends_the_row_at_its_stations():
    record = scene()
    turned = tuple(
        replace(each, base_T_gripper=se3.inverse(each.base_T_gripper)) for each in record.stations
    )
    found = outcome(replace(record, stations=turned))
    assert (found.row.status, found.row.exit_code) == (BatchStatus.FAILED, 4)
    assert (found.row.stations, found.row.used, found.calibration) == (12, None, None)


def test_findings_make_warnings_but_for_those_that_only_inform():
    record = scene()
    noted = replace(record, findings=(Finding("by-the-way", "info", "so it is"),))
    assert outcome(noted).row.status is BatchStatus.OK
    warned = replace(noted, findings=(*noted.findings, Finding("dust", "warning", "on the lens")))
    row = outcome(warned).row
    assert (row.status, row.exit_code, row.findings) == (BatchStatus.WARNINGS, 0, ("dust",))


def test_a_recording_that_cannot_be_read():
    def opening():
        raise InputError("expected YAML, found soup", where="cell, line 2", hint="eat it")

    row = outcome_of("cell", opening, TREATMENT).row
    assert row == BatchRow(
        "cell",
        BatchStatus.FAILED,
        3,
        message="line 2: expected YAML, found soup",
        advice="eat it",
    )


def test_a_bug_is_not_taken_for_a_bad_recording():
    def opening():
        raise KeyError("a bug")

    with pytest.raises(KeyError, match="a bug"):
        outcome_of("cell", opening, TREATMENT)


KINDS = [UsageError, InputError, UndeterminedError, ConvergenceError, QualityGateError]


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_leaves_with_its_gravest_code(kind):
    gravest = failed(BatchRow("a"), kind("so"))
    others = [
        failed(BatchRow("b"), each("so")) for each in KINDS if each.exit_code > kind.exit_code
    ]
    batch = Batch((BatchRow("fine"), *others, gravest))
    assert batch.exit_code == kind.exit_code
    bug = failed(BatchRow("c"), HandeyeError("so"))
    assert Batch((*batch.rows, bug)).exit_code == 1
    interrupted = BatchRow("d", BatchStatus.CANCELLED, CANCELLED_CODE)
    assert Batch((*batch.rows, bug, interrupted)).exit_code == CANCELLED_CODE
    assert Batch((BatchRow("fine"), BatchRow("so", BatchStatus.WARNINGS))).exit_code == 0


def test_the_worst_come_first():
    rows = (
        BatchRow("good", seen_translation=1e-4),
        BatchRow("less good", seen_translation=2e-4),
        BatchRow("warned", BatchStatus.WARNINGS),
        BatchRow("cancelled", BatchStatus.CANCELLED, CANCELLED_CODE),
        BatchRow("missed", BatchStatus.GATE, 6),
        BatchRow("undetermined", BatchStatus.FAILED, 4),
        BatchRow("unreadable", BatchStatus.FAILED, 3),
    )
    assert [row.name for row in Batch(rows).worst_first()] == [
        "unreadable", "undetermined", "missed", "cancelled", "warned", "less good", "good",
    ]  # fmt: skip
