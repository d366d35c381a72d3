"""Every record through its document and back, and documents against an independent validator."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from decimal import Decimal

import jsonschema
import numpy as np
import pytest
import yaml
from documents import samples
from hypothesis import given
from hypothesis import strategies as st
from referencing import Registry, Resource
from scipy.spatial.transform import Rotation

from handeye_cli import documents
from handeye_cli.conventions import MIL
from handeye_cli.documents import layout, schema
from handeye_cli.documents.units import from_milli, to_milli, with_floats
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.records import Protocol

NAMES = [
    "recording",
    "features",
    "stations",
    "calibration",
    "calibration-eye-to-hand",
    "verification",
    "inspection",
    "plan",
]


UNWRITTEN = {"Recording.frames", "Recording.moving"}
"""Known of robots' recordings only, which are no documents."""


@pytest.fixture
def records(tmp_path):
    return samples.records(np.random.default_rng(5), tmp_path)


def test_the_samples_leave_no_field_of_a_record_out(records):
    # else a new field could be lost on the way without a test that fails
    assert set(samples.fields_at_default(records)) == UNWRITTEN


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize("name", NAMES)
def test_record_comes_back_as_it_was(records, tmp_path, name, ending):
    path = str(tmp_path / f"document.{ending}")
    documents.write(records[name], path)
    samples.assert_same(documents.read(path), records[name])


@pytest.mark.parametrize("name", ["features", "stations"])
def test_as_written_is_to_the_last_bit_what_comes_back(records, tmp_path, name):
    path = str(tmp_path / "document.json")
    rotations = Rotation.from_quat(np.random.default_rng(7).normal(size=(100, 4))).as_matrix()
    poses = se3.from_parts(rotations, np.zeros(3))
    station = records[name].stations[0]
    stations = tuple(
        replace(station, name=str(i), base_T_gripper=pose) for i, pose in enumerate(poses)
    )
    record = replace(records[name], stations=stations)
    documents.write(record, path)
    found = [each.base_T_gripper for each in documents.as_written(record).stations]
    np.testing.assert_array_equal(
        found, [each.base_T_gripper for each in documents.read(path).stations]
    )
    # else nothing would be lost, and nothing would have to be done
    assert not np.array_equal(found, poses)


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("name", NAMES)
def test_equal_records_give_the_same_bytes(records, tmp_path, name, form):
    others = samples.records(np.random.default_rng(5), tmp_path)
    assert documents.dump(records[name], form) == documents.dump(others[name], form)


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("name", NAMES)
def test_our_documents_satisfy_the_schema_files_for_other_readers(records, name, form):
    text = documents.dump(records[name], form)
    data = yaml.safe_load(text) if form == "yaml" else json.loads(text)
    kind = data["schema"].split("/")[1]
    assert kind == name.split("-")[0]
    validator_for_editors(kind).validate(data)


def validator_for_editors(kind):
    """The schema file as it lies on disk, its neighbour found by its relative name."""
    folder = schema.folder()
    contents = {path.name: json.loads(path.read_text()) for path in folder.glob("*.schema.json")}
    registry = Registry().with_resources(
        (name, Resource.from_contents(content)) for name, content in contents.items()
    )
    content = contents[f"{kind}.schema.json"]
    jsonschema.Draft7Validator.check_schema(content)
    return jsonschema.Draft7Validator(content, registry=registry)


def test_names_that_look_like_numbers_or_booleans_stay_text(records):
    for form in ("yaml", "json"):
        text = documents.dump(records["features"], form)
        back = documents.read("-", stdin=io.BytesIO(text.encode()))
        assert [station.name for station in back.stations] == ["no", "1e5", "02", "a: b"]


def test_verification_rows_carry_the_papers_unit(records):
    data = yaml.safe_load(documents.dump(records["verification"], "yaml"))
    assert data["rows"][0]["rotation_mrad"] == 4.568
    assert data["rows"][0]["translation_mil"] == pytest.approx(5.9e-4 / MIL, rel=1e-15)


def test_calibration_names_its_poses_by_the_setup(records):
    in_hand = yaml.safe_load(documents.dump(records["calibration"], "yaml"))
    beside = yaml.safe_load(documents.dump(records["calibration-eye-to-hand"], "yaml"))
    assert {key for key in in_hand if "_T_" in key} == {"gripper_T_camera", "base_T_target"}
    assert {key for key in beside if "_T_" in key} == {"base_T_camera", "gripper_T_target"}


def read_changed(record, change):
    data = json.loads(documents.dump(record, "json"))
    change(data)
    return documents.read("-", stdin=io.BytesIO(json.dumps(data).encode()))


def test_the_covariance_between_the_poses_follows_their_unit(records):
    found = read_changed(records["calibration"], lambda data: data.update(pose_units="mm"))
    metres = np.array([1e-3] * 3 + [1.0] * 3)
    expected = records["calibration"].covariance_between * np.outer(metres, metres)
    np.testing.assert_allclose(found.covariance_between, expected, rtol=1e-15)


def test_a_covariance_between_the_poses_must_fit_their_own(records):
    def double(data):
        data["covariance_between"] = (2.0 * np.array(data["covariance_between"])).tolist()

    with pytest.raises(InputError, match="without negative eigenvalues, found the eigen") as caught:
        read_changed(records["calibration"], double)
    assert "covariance_between" in caught.value.where
    with pytest.raises(InputError, match="beside the covariances of both poses, found it without"):
        read_changed(records["calibration"], lambda data: data["base_T_target"].pop("covariance"))


def test_a_verification_that_does_not_say_its_protocol_is_the_papers(records):
    found = read_changed(records["verification"], lambda data: data.pop("protocol"))
    assert found.protocol is Protocol.SPLIT


def test_poses_are_written_as_translation_and_quaternion_in_metres(records):
    data = yaml.safe_load(documents.dump(records["stations"], "yaml"))
    matrix = records["stations"].stations[0].base_T_gripper
    pose = data["stations"][0]["base_T_gripper"]
    assert list(pose) == ["translation", "quaternion"]
    assert pose["translation"] == matrix[:3, 3].tolist()
    assert np.linalg.norm(pose["quaternion"]) == pytest.approx(1.0, abs=1e-15)


def test_a_number_that_is_not_finite_is_never_written(records):
    noise = replace(samples.NOISE, robot_rotation=np.inf)
    for form in ("yaml", "json"):
        with pytest.raises(ValueError, match="Infinity"):
            documents.dump(replace(records["stations"], noise=noise), form)


@given(st.floats(min_value=0.0, max_value=1e25))
def test_unit_suffixed_numbers_come_back_to_the_last_bit(value):
    text = layout.dump({"x_mrad": to_milli(value)}, "yaml")
    assert from_milli(Decimal(text.split()[1])) == value


@given(st.decimals(min_value=0, max_value=10**6, places=6, allow_nan=False))
def test_what_a_person_writes_in_milli_units_is_written_back_so(number):
    assert to_milli(from_milli(number)) == number


def test_with_floats_leaves_no_decimals():
    data = {"a": Decimal("0.1"), "b": [Decimal(2), {"c": "x"}], "d": None}
    assert repr(with_floats(data)) == "{'a': 0.1, 'b': [2.0, {'c': 'x'}], 'd': None}"
