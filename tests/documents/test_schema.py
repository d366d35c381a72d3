"""Faults in documents, one row each: what is said, and about which key."""

from __future__ import annotations

import copy
import io

import numpy as np
import pytest
import yaml
from documents import samples

from handeye_cli import documents
from handeye_cli.documents import schema
from handeye_cli.errors import InputError

POSE = {"translation": [0, 0, 0], "quaternion": [0, 0, 0, 1]}
CAMERA = {"width": 640, "height": 480, "fx": 550, "fy": 550, "cx": 320, "cy": 240}


def station(**changes):
    return {"name": "a", "base_T_gripper": POSE, "camera_T_target": POSE} | changes


def stations_with(**changes):
    """A stations document with changed keys; None takes a key away."""
    data = {"schema": "handeye/stations/1", "setup": "eye-in-hand", "stations": [station()]}
    return {key: value for key, value in (data | changes).items() if value is not None}


def read(data):
    content = data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False)
    return documents.read("-", stdin=io.BytesIO(content.encode()))


def first_pose(**keys):
    return stations_with(stations=[station(base_T_gripper=keys)])


def second_station(**keys):
    return stations_with(stations=[station(), station(name="b") | keys])


FAULTS = {
    "no mapping": ([1], "a line such as schema: handeye/stations/1, found a list of 1", ""),
    "no schema": ({"setup": 1}, "found the keys setup", ""),
    "misspelt kind": (
        stations_with(schema="handeye/statoins/1"),
        "did you mean .*stations/1",
        "schema",
    ),
    "other kind": (
        stations_with(schema="handeye/movie/1"),
        "kinds: recording, features",
        "schema",
    ),
    "no text": (stations_with(schema=3), "found the number 3", "schema"),
    "newer version": (stations_with(schema="handeye/plan/2"), "found version 2", "schema"),
    "no setup": (stations_with(setup=None), "--setup eye-in-hand[|]eye-to-hand", ""),
    "wrong setup": (stations_with(setup="eye-on-hand"), "did you mean eye-to-hand", "setup"),
    "missing stations": (stations_with(stations=None), "the key 'stations'", ""),
    "unknown key": (stations_with(cammera=1), "did you mean 'camera'", "cammera"),
    "unknown far key": (stations_with(zzz=1), "known keys: camera, findings", "zzz"),
    "misspelt before missing": (
        stations_with(stations=None, sttaions=[]),
        "did you mean 'stations'",
        "sttaions",
    ),
    "no pose": (first_pose(translation=[0, 0, 0]), "expected a pose", "stations[0].base_T_gripper"),
    "two rotations": (
        first_pose(**POSE, rotvec=[0, 0, 0]),
        "exactly one of .* found .* rotvec",
        "stations[0].base_T_gripper",
    ),
    "matrix and translation": (
        first_pose(matrix=np.eye(4).tolist(), translation=[0, 0, 0]),
        "without a translation",
        "stations[0].base_T_gripper",
    ),
    "misspelt form": (
        first_pose(translation=[0, 0, 0], quaternoin=[0, 0, 0, 1]),
        "did you mean 'quaternion'",
        "stations[0].base_T_gripper.quaternoin",
    ),
    "three numbers": (
        first_pose(translation=[0, 0, 0], quaternion=[0, 0, 1]),
        "four numbers, found a list of 3",
        "stations[0].base_T_gripper.quaternion",
    ),
    "a word": (
        first_pose(translation=[0, "zero", 0], quaternion=[0, 0, 0, 1]),
        "a number, found 'zero'",
        "stations[0].base_T_gripper.translation[1]",
    ),
    "a boolean": (
        first_pose(translation=[0, True, 0], quaternion=[0, 0, 0, 1]),
        "a number, found true",
        "stations[0].base_T_gripper.translation[1]",
    ),
    "not a number": (
        first_pose(translation=[0, float("nan"), 0], quaternion=[0, 0, 0, 1]),
        "finite number .* found nan",
        "stations[0].base_T_gripper.translation[1]",
    ),
    "far too large": (
        first_pose(translation=[0, 1e200, 0], quaternion=[0, 0, 0, 1]),
        "finite number .* found 1e[+]200",
        "stations[0].base_T_gripper.translation[1]",
    ),
    "mixed axes": (
        first_pose(translation=[0, 0, 0], euler=[0, 0, 0], order="xyZ"),
        "three axes of one case, .* found 'xyZ'",
        "stations[0].base_T_gripper.order",
    ),
    "degrees of a quaternion": (
        first_pose(**POSE, degrees=True),
        "the key 'euler' beside 'degrees'",
        "stations[0].base_T_gripper",
    ),
    "neither pose nor reason": (
        stations_with(stations=[{"base_T_gripper": POSE}]),
        "or with a reason",
        "stations[0]",
    ),
    "ids without pixels": (second_station(ids=[1]), "'pixels' beside 'ids'", "stations[1]"),
    "too few ids": (
        second_station(ids=[1], pixels=[[1, 2], [3, 4]]),
        "found 1 ids, 2 pixels",
        "stations[1].ids",
    ),
    "an id twice": (
        second_station(ids=[7, 7], pixels=[[1, 2], [3, 4]]),
        "found 7 more than once",
        "stations[1].ids",
    ),
    "a name twice": (second_station(name="a"), "found 'a' at 0 and at 1", "stations[1]"),
    "an empty name": (second_station(name=""), "found ''", "stations[1].name"),
    "14 coefficients": (
        stations_with(camera=CAMERA | {"distortion": [0] * 14}),
        "not the 14 of the tilted model.*found a list of 14",
        "camera.distortion",
    ),
    "half a pixel": (
        stations_with(camera=CAMERA | {"width": 640.5}),
        "whole number .* found the number 640.5",
        "camera.width",
    ),
    "a camera's covariance of another size": (
        stations_with(camera=CAMERA | {"covariance": np.eye(5).tolist()}),
        "4 rows of 4 numbers, found 5 rows of 5",
        "camera.covariance",
    ),
    "negative noise": (
        stations_with(noise={"robot_rotation_mrad": -0.5}),
        "at least 0, found the number -0.5",
        "noise.robot_rotation_mrad",
    ),
    "a target without type": (stations_with(target={"rows": 6}), "the key 'type'", "target"),
    "a list in a target": (
        stations_with(target={"type": "x", "{r}]": [1]}),
        "found a list of 1",
        "target.{r}]",
    ),
    "a digest too short": (
        stations_with(
            provenance=[{"command": "a", "version": "1", "inputs": [{"file": "f", "sha256": "0"}]}]
        ),
        "64 hexadecimal digits, found '0'",
        "provenance[0].inputs[0].sha256",
    ),
    "simulation": (
        {"schema": "handeye/simulation/1", "trials": 1},
        "the errors of one setting",
        "",
    ),
    "inspection": (
        {"schema": "handeye/inspection/1", "setup": "eye-in-hand"},
        "the key 'stations'",
        "",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_named_with_its_key(fault):
    data, message, path = FAULTS[fault]
    with pytest.raises(InputError, match=message) as caught:
        read(data)
    place = caught.value.where.removeprefix("standard input").removeprefix(": ")
    assert place.split(" (station")[0] == path


def test_fault_in_a_named_station_says_its_name():
    with pytest.raises(InputError) as caught:
        read(second_station(base_T_gripper={"rotvec": [0, 0, 0]}))
    assert caught.value.where == 'standard input: stations[1].base_T_gripper (station "b")'


def test_a_fault_of_arithmetic_says_the_station_too():
    with pytest.raises(InputError) as caught:
        read(second_station(camera_T_target=POSE | {"quaternion": [0, 0, 0, 2]}))
    where = 'standard input: stations[1].camera_T_target.quaternion (station "b")'
    assert caught.value.where == where


def changed_calibration(**changes):
    data = yaml.safe_load(documents.dump(samples.calibration(np.random.default_rng(1)), "yaml"))
    return data | changes


def test_a_calibration_has_the_poses_of_its_setup():
    with pytest.raises(InputError, match="'base_T_camera' of an eye-to-hand calibration, found g"):
        read(changed_calibration(setup="eye-to-hand"))


@pytest.mark.parametrize(("pair", "found"), [([0, 3], r"found \[0, 3\]"), ([1, 1], "found .1, 1.")])
def test_a_pair_is_of_two_of_the_stations(pair, found):
    with pytest.raises(InputError, match=f"the 3 stations .0 to 2., {found}") as caught:
        read(changed_calibration(pairs=[[0, 1], pair]))
    assert caught.value.where == "standard input: pairs[1]"


@pytest.mark.parametrize(
    "entry",
    [
        {"found": True},
        {"found": False},
        {"found": False, "reason": "x", "ids": [0], "pixels": [[1, 2]]},
    ],
)
def test_features_are_found_or_have_a_reason(entry):
    data = {
        "schema": "handeye/features/1",
        "setup": "eye-in-hand",
        "target": {"type": "disc-grid"},
        "stations": [{"base_T_gripper": POSE} | entry],
    }
    with pytest.raises(InputError, match="where found is true, with a reason where it is false"):
        read(data)


@pytest.mark.parametrize(
    ("data", "found"), [(5, "the number 5"), ("abc", "'abc'"), (None, "nothing"), ([1], "a list")]
)
def test_what_is_no_mapping_has_no_keys(data, found):
    with pytest.raises(InputError, match=f"expected a mapping, found {found}") as caught:
        schema.validate(data, "plan", "f")
    assert caught.value.where == "f"


def test_a_plan_has_stations():
    data = yaml.safe_load(documents.dump(samples.plan(np.random.default_rng(1)), "yaml"))
    with pytest.raises(InputError, match="found a list of 0") as caught:
        read(data | {"stations": [], "pairs": []})
    assert caught.value.where == "standard input: stations"


def texts_in(data, path=()):
    """Yield the path of every text; of a list that of its first item, which stands for all."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data[:1]):
        if isinstance(value, dict | list):
            yield from texts_in(value, (*path, key))
        elif isinstance(value, str):
            yield (*path, key)


def replaced(data, path, value):
    """Return a copy with another value at a path."""
    key, *rest = path
    copied = copy.copy(data)
    copied[key] = replaced(data[key], rest, value) if rest else value
    return copied


@pytest.mark.parametrize(
    "kind",
    ["recording", "features", "stations", "calibration", "verification", "inspection", "plan"],
)
def test_a_list_for_a_text_is_a_fault_of_the_document(kind, tmp_path):
    """Names, codes and choices are looked up in tables, where no list can be."""
    record = samples.records(np.random.default_rng(3), tmp_path)[kind]
    data = yaml.safe_load(documents.dump(record, "yaml"))
    refused = 0
    for path in texts_in(data):
        try:
            read(replaced(data, path, [1]))
        except InputError:
            refused += 1
    assert refused >= 2


@pytest.mark.parametrize("kind", schema.KINDS)
def test_every_kind_has_its_schema(kind):
    loaded = schema.load(kind)
    assert loaded["properties"]["schema"] == {"enum": [schema.header(kind)]}
    assert "common.schema.json" not in repr(loaded)
