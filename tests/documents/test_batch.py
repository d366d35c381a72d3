"""Batch documents: there and back, their schema, and the faults a reader meets."""

import io
import json

import jsonschema
import pytest
import yaml
from documents import samples
from documents.test_round_trip import validator_for_editors

from handeye_cli import documents
from handeye_cli.errors import InputError
from handeye_cli.records import ProvenanceStep
from handeye_cli.records.batch import CANCELLED_CODE, Batch, BatchRow, BatchStatus

FULL = BatchRow(
    name="cells/00.mcap",
    status=BatchStatus.GATE,
    exit_code=6,
    sha256="12" * 32,
    stations=12,
    used=11,
    predicted_rotation=8.1e-4,
    predicted_translation=1.9e-4,
    seen_rotation=9.1e-4,
    seen_translation=2.9e-4,
    consistent=False,
    findings=("few-stations", "time-offset"),
    message="calibrated on 6 stations: the errors contradict the prediction",
    advice="look at it",
    calibration="answers/00.yaml",
    seconds=1.25,
)
BATCH = Batch(
    rows=(
        BatchRow("007"),
        FULL,
        BatchRow("no", BatchStatus.FAILED, 4, stations=0, message="nothing there"),
        BatchRow("late", BatchStatus.CANCELLED, CANCELLED_CODE),
    ),
    provenance=(ProvenanceStep("batch", "0.1.0", (), {"strict": True}),),
)


@pytest.mark.parametrize("ending", ["yaml", "json"])
def test_a_batch_comes_back_as_it_was(tmp_path, ending):
    path = str(tmp_path / f"batch.{ending}")
    documents.write(BATCH, path)
    samples.assert_same(documents.read(path), BATCH)


def test_the_document_satisfies_its_schema_for_other_readers():
    data = json.loads(documents.dump(BATCH, "json"))
    validator_for_editors("batch").validate(data)
    data["rows"][0]["status"] = "so-so"
    with pytest.raises(jsonschema.ValidationError):
        validator_for_editors("batch").validate(data)


def test_what_is_unknown_is_left_out_and_units_are_those_of_people():
    data = yaml.safe_load(documents.dump(BATCH, "yaml"))
    assert data["exit_code"] == CANCELLED_CODE
    assert data["rows"][0] == {"name": "007", "status": "ok", "exit_code": 0}
    assert data["rows"][1]["predicted_error"] == {"rotation_mrad": 0.81, "translation_mm": 0.19}
    assert data["rows"][1]["seen_error"] == {"rotation_mrad": 0.91, "translation_mm": 0.29}


def test_a_batch_without_provenance_has_no_such_key():
    text = documents.dump(Batch((BatchRow("a"),)), "yaml")
    assert "provenance" not in text
    assert documents.read("-", stdin=io.BytesIO(text.encode())) == Batch((BatchRow("a"),))


FAULTS = {
    "an unknown status": ({"status": "fine"}, "found 'fine'"),
    "a misspelt key": ({"stattions": 3}, "did you mean 'stations'"),
    "half an error": ({"seen_error": {"rotation_mrad": 1}}, "the key 'translation_mm'"),
    "a code beyond all": ({"exit_code": 256}, "found the number 256"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(fault):
    changes, message = FAULTS[fault]
    data = yaml.safe_load(documents.dump(BATCH, "yaml"))
    data["rows"][2] |= changes
    with pytest.raises(InputError) as caught:
        documents.read("-", stdin=io.BytesIO(yaml.safe_dump(data).encode()))
    assert message in str(caught.value)
    assert "rows[2]" in caught.value.where
