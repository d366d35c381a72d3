"""Simulation documents: there and back, their schema, and the units people read."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import jsonschema
import pytest
import yaml
from documents import samples
from documents.simulations import BASE, ERRORS, FIGURES
from documents.test_round_trip import validator_for_editors

from handeye_cli import documents
from handeye_cli.errors import InputError

RECORDS = {
    "one setting": replace(BASE, errors=ERRORS),
    "a figure": replace(BASE, figures=FIGURES[:1]),
    "a figure over lengths": replace(BASE, figures=FIGURES[3:4]),
    "all figures": replace(BASE, figures=FIGURES),
}


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize("name", RECORDS)
def test_a_simulation_comes_back_as_it_was(tmp_path, name, ending):
    path = str(tmp_path / f"simulation.{ending}")
    documents.write(RECORDS[name], path)
    samples.assert_same(documents.read(path), RECORDS[name])


@pytest.mark.parametrize("name", RECORDS)
def test_the_document_satisfies_its_schema_for_other_readers(name):
    data = json.loads(documents.dump(RECORDS[name], "json"))
    validator_for_editors("simulation").validate(data)
    del data["setting"]["tilt_deg"]
    with pytest.raises(jsonschema.ValidationError):
        validator_for_editors("simulation").validate(data)


def test_units_are_those_of_people():
    data = yaml.safe_load(documents.dump(RECORDS["one setting"], "yaml"))
    assert (data["rotation_rms_mrad"], data["translation_rms_mm"]) == (3.15, 0.688)
    assert data["setting"] == {
        "stations": 3, "distance_mm": 168.91, "tilt_deg": 30.0, "lever_mm": 241.3, "pairs": "all",
    }  # fmt: skip
    figure = yaml.safe_load(documents.dump(RECORDS["a figure"], "yaml"))
    assert figure["abscissa"] == "1 / interstation angle [1/rad]"
    assert figure["ordinate"] == "rotation error [mrad]"
    assert figure["points"][1] == {
        "abscissa": 0.5, "rms": 4.0, "max": 100.0, "predicted": 5.0, "crb": 1e-297,
    }  # fmt: skip
    assert (figure["line"]["slope"], figure["line"]["intercept"]) == (6.0, -1.0)
    lengths = yaml.safe_load(documents.dump(RECORDS["a figure over lengths"], "yaml"))
    assert lengths["abscissa"] == "distance from camera to target [mm]"
    assert lengths["points"][1]["abscissa"] == 500.0
    assert (lengths["line"]["slope"], lengths["line"]["intercept"]) == (6e-3, -1.0)


FAULTS = {
    "neither errors nor figures": (["points"], {}, "the errors of one setting, or a figure"),
    "no method": (["method"], {}, "the key 'method'"),
    "another figure": ([], {"figure": 7}, "8 to 13, found the number 7"),
    "a misspelt key": ([], {"trails": 3}, "did you mean 'trials'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(fault):
    removed, changes, message = FAULTS[fault]
    data = yaml.safe_load(documents.dump(RECORDS["a figure"], "yaml")) | changes
    text = yaml.safe_dump({key: value for key, value in data.items() if key not in removed})
    with pytest.raises(InputError, match=message):
        documents.read("-", stdin=io.BytesIO(text.encode()))
