"""Validators compiled for the keys of one document say the same as those of the whole schema."""

import copy

import fastjsonschema
import numpy as np
import pytest

from handeye_cli.documents import schema

POSE = {"translation": [0.1, 0.2, 0.3], "quaternion": [0.0, 0.0, 0.0, 1.0]}
EULER = {"translation": [0.1, 0.2, 0.3], "euler": [1, 2, 3], "order": "xyz", "degrees": True}
CAMERA = {"width": 640, "height": 480, "fx": 550.0, "fy": 550.0, "cx": 320, "cy": 240}
SEEN = {"ids": [0, 1], "pixels": [[1.0, 2.0], [3.0, 4.0]], "sigma_px": 0.1}
DOCUMENTS = {
    "stations": {
        "schema": "handeye/stations/1",
        "setup": "eye-in-hand",
        "noise": {"robot_rotation_mrad": 1.0},
        "camera": CAMERA,
        "stations": [
            {"name": "00", "base_T_gripper": POSE, "camera_T_target": EULER, **SEEN},
            {"name": 1, "base_T_gripper": {"matrix": np.eye(4).tolist()}, "reason": "dark"},
        ],
    },
    "features": {
        "schema": "handeye/features/1",
        "setup": "eye-to-hand",
        "target": {"type": "chessboard", "columns": 9, "rows": 6, "square_mm": 20},
        "stations": [
            {"name": "00", "base_T_gripper": POSE, "found": True, **SEEN},
            {"name": "01", "base_T_gripper": EULER, "found": False, "reason": "dark"},
        ],
    },
}
KEYS = ["translation", "matrix", "euler", "order", "ids", "pixels", "found", "reason", "none", "fx"]
VALUES = [None, True, -1, 2.5, "xyz", "", [], [1.0, 2.0, 3.0], [[1.0, 2.0]], {}, POSE]
DAMAGES = 400


def containers(data):
    yield data
    for item in data.values() if isinstance(data, dict) else data:
        if isinstance(item, dict | list):
            yield from containers(item)


def damaged(document, rng):
    """Return a copy with a key or item taken away, added or with another value."""
    data = copy.deepcopy(document)
    places = list(containers(data))
    place = places[rng.integers(len(places))]
    value = copy.deepcopy(VALUES[rng.integers(len(VALUES))])
    known = list(place) if isinstance(place, dict) else range(len(place))
    change = rng.integers(3)
    if change == 0 and isinstance(place, dict):
        place[KEYS[rng.integers(len(KEYS))]] = value
    elif change == 0:
        place.append(value)
    elif known and change == 1:
        del place[known[rng.integers(len(known))]]
    elif known:
        place[known[rng.integers(len(known))]] = value
    return data


def accepts(validator, data):
    try:
        validator(data)
    except fastjsonschema.JsonSchemaValueException:
        return False
    return True


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_whole_and_pruned_schemas_agree(kind, monkeypatch):
    whole = fastjsonschema.compile(schema.load(kind), use_default=False)
    refused = []
    monkeypatch.setattr(schema, "_complete_validator", lambda _: refused.append)
    rng = np.random.default_rng(1)
    verdicts = []
    for data in [DOCUMENTS[kind], *(damaged(DOCUMENTS[kind], rng) for _ in range(DAMAGES))]:
        refused.clear()
        schema.validate(data, kind, "a document")
        verdicts.append(accepts(whole, data))
        assert verdicts[-1] == (not refused), data
    assert verdicts[0]
    assert 0.05 < np.mean(verdicts) < 0.9
