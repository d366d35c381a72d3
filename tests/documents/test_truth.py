"""Truth documents: there and back, their schema, and what they refuse."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
import yaml
from documents import samples
from documents.test_round_trip import validator_for_editors

from handeye_cli import documents
from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup
from handeye_cli.documents import ReadOptions
from handeye_cli.errors import InputError
from handeye_cli.records.truth import TrueStation, Truth

RNG = np.random.default_rng(11)
TRUTH = Truth(
    setup=Setup.EYE_IN_HAND,
    mount_T_camera=samples.pose(RNG),
    reference_T_target=samples.pose(RNG),
    stations=tuple(TrueStation(f"0{k}", samples.pose(RNG), samples.pose(RNG)) for k in range(3)),
    seed=7,
    robot_rotation=2.0e-4,
    robot_translation=1 / 3000,
    image_noise=2.0,
    blur_px=0.7,
    faults=("swapped:0,2", "bowed:1mm"),
    provenance=samples.PROVENANCE,
)
RECORDS = {"eye-in-hand": TRUTH, "eye-to-hand": replace(TRUTH, setup=Setup.EYE_TO_HAND)}


def text_of(record, form="json"):
    return documents.dump(record, form)


def read(text, options=None):
    return documents.read("-", options or ReadOptions(), io.BytesIO(text.encode()))


def changed(**changes):
    """A truth with changed keys; None takes a key away."""
    data = json.loads(text_of(TRUTH)) | changes
    return json.dumps({key: value for key, value in data.items() if value is not None})


def test_the_sample_leaves_no_field_out():
    assert samples.fields_at_default(TRUTH) == []


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("name", RECORDS)
def test_a_truth_comes_back_as_it_was(name, form):
    samples.assert_same(read(text_of(RECORDS[name], form)), RECORDS[name])


def test_the_poses_have_the_names_of_their_setup_and_the_units_those_of_people():
    data = yaml.safe_load(text_of(RECORDS["eye-to-hand"], "yaml"))
    assert next(iter(data)) == "schema"
    assert data["schema"] == "handeye/truth/1"
    assert data["base_T_camera"]["translation"] == TRUTH.mount_T_camera[:3, 3].tolist()
    assert data["gripper_T_target"]["translation"] == TRUTH.reference_T_target[:3, 3].tolist()
    assert data["noise"] == {
        "robot_rotation_mrad": 0.2,
        "robot_translation_mm": 1 / 3,
        "image_grey_levels": 2.0,
    }


def test_the_document_satisfies_its_schema_for_other_readers():
    data = json.loads(text_of(TRUTH))
    validator_for_editors("truth").validate(data)
    data["stations"][0]["camera_T_target"]["covariance"] = np.eye(6).tolist()
    with pytest.raises(jsonschema.ValidationError):
        validator_for_editors("truth").validate(data)


def test_no_flag_changes_what_is_true():
    flags = ReadOptions(
        Setup.EYE_TO_HAND, PoseUnits.MM, QuaternionOrder.WXYZ, RobotPoses.BASE_IN_GRIPPER
    )
    samples.assert_same(read(text_of(TRUTH), flags), TRUTH)


FAULTS = {
    "no setup": (changed(setup=None), "the key 'setup'", ""),
    "poses of the other setup": (
        changed(setup="eye-to-hand"),
        "'base_T_camera' of the truth of an eye-to-hand recording, found gripper_T_camera, base_T_",
        "",
    ),
    "one pose": (changed(base_T_target=None), "the true answer with its constant", ""),
    "misspelt key": (changed(blurr_px=1.0), "did you mean 'blur_px'", "blurr_px"),
    "negative noise": (changed(blur_px=-0.5), "at least 0, found the number -0.5", "blur_px"),
    "a broken quaternion": (
        changed(gripper_T_camera={"translation": [0, 0, 0], "quaternion": [0, 0, 0, 3]}),
        "found the norm 3",
        "gripper_T_camera.quaternion",
    ),
    "a name twice": (
        changed(stations=2 * json.loads(text_of(TRUTH))["stations"][:1]),
        "found '00' at 0 and at 1",
        "stations[1]",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_named_with_its_key(fault):
    text, message, path = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        read(text)
    assert message in caught.value.message + (caught.value.hint or "")
    assert caught.value.where.removeprefix("standard input").removeprefix(": ") == path
