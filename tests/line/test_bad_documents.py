"""Bad documents, one row a fault: exit code 3, and a message that names the place and the value."""

import copy

import numpy as np
import pytest
from line.good_input import write

GONE = object()
"""In place of a value: the key is taken out."""
SECOND = ("stations", 1)
ROBOT = (*SECOND, "base_T_gripper")
CAMERA = (*SECOND, "camera_T_target")
COVARIANCE = (*CAMERA, "covariance")


def edited(document, path, value):
    """Return a document with another value at a path of keys and indices."""
    document = copy.deepcopy(document)
    *way, last = path
    at = document
    for key in way:
        at = at[key]
    if value is GONE:
        del at[last]
    else:
        at[last] = value(at[last]) if callable(value) else value
    return document


def diagonal(*values):
    return np.diag([*values, *[1e-6] * (6 - len(values))]).tolist()


def lopsided():
    rows = diagonal()
    rows[0][1] = 2e-7
    return rows


STRETCHED = [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
MIRROR = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]
LAST_ROW = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]]
DEGREES = {"translation": [0, 0, 0], "euler": [10, 20, 90], "order": "xyz"}
TWO_ROTATIONS = {"translation": [0, 0, 0], "rotvec": [0, 0, 0], "quaternion": [0, 0, 0, 1]}

DOCUMENTS = {
    "zero-quaternion": (
        "solve", "stations", (*ROBOT, "quaternion"), [0, 0, 0, 0],
        ['in.yaml: stations[1].base_T_gripper.quaternion (station "01")', "found the norm 0"],
    ),
    "double-quaternion": (
        "solve", "stations", (*CAMERA, "quaternion"), lambda q: [2 * x for x in q],
        ["stations[1].camera_T_target.quaternion", "norm 1 (within 0.01), found the norm 2"],
    ),
    "three-numbers": (
        "verify", "stations", (*ROBOT, "quaternion"), [0, 0, 1],
        ["stations[1].base_T_gripper.quaternion", "expected four numbers, found a list of 3"],
    ),
    "nan": (
        "solve", "stations", (*ROBOT, "translation", 1), float("nan"),
        ["stations[1].base_T_gripper.translation[1]", "expected a finite number", "found nan"],
    ),
    "infinity": (
        "solve", "stations", (*CAMERA, "translation", 2), float("-inf"),
        ["stations[1].camera_T_target.translation[2]", "found -inf"],
    ),
    "text-for-a-number": (
        "solve", "stations", (*ROBOT, "translation", 0), "0.1m",
        ["stations[1].base_T_gripper.translation[0]", "expected a number, found '0.1m'"],
    ),
    "text-for-a-pose": (
        "solve", "stations", ROBOT, "0 0 0 1", ["stations[1].base_T_gripper", "found '0 0 0 1'"],
    ),
    "no-robot-pose": (
        "solve", "stations", ROBOT, GONE, ["stations[1]", "expected the key 'base_T_gripper'"],
    ),
    "mirror": (
        "solve", "stations", ROBOT, {"matrix": MIRROR},
        ["stations[1].base_T_gripper.matrix", "determinant is -1", "left-handed"],
    ),
    "stretched": (
        "solve", "stations", ROBOT, {"matrix": STRETCHED},
        ["expected a rotation matrix (within 0.001)", "1 away from the nearest rotation"],
    ),
    "last-row": (
        "solve", "stations", ROBOT, {"matrix": LAST_ROW},
        ["expected the last row [0, 0, 0, 1], found [0.0, 0.0, 0.0, 2.0]"],
    ),
    "degrees": ("solve", "stations", ROBOT, DEGREES, ["found 90 rad", "degrees: true"]),
    "two-rotations": (
        "solve", "stations", ROBOT, TWO_ROTATIONS,
        ["exactly one of quaternion, rotvec", "the keys translation, rotvec, quaternion"],
    ),
    "covariance-of-five-rows": (
        "solve", "stations", COVARIANCE, diagonal()[:5], ["covariance", "found a list of 5"],
    ),
    "covariance-not-symmetric": (
        "solve", "stations", COVARIANCE, lopsided(),
        ["stations[1].camera_T_target.covariance", "found 2e-07 at [0][1] and 0 at [1][0]"],
    ),
    "covariance-negative": (
        "solve", "stations", COVARIANCE, diagonal(-1e-6), ["found the eigenvalue -1e-06"],
    ),
    "covariance-of-the-robot": (
        "solve", "stations", (*ROBOT, "covariance"), diagonal(-1e-6),
        ["stations[1].base_T_gripper", "found the eigenvalue -1e-06"],
    ),
    "misspelt-key": (
        "solve", "stations", (*SECOND, "camera_T_tagret"), {},
        ["stations[1].camera_T_tagret", "unknown key", "did you mean 'camera_T_target'?"],
    ),
    "name-twice": (
        "solve", "stations", (*SECOND, "name"), "00", ["stations[1]", "found '00' at 0 and at 1"],
    ),
    "no-setup": ("solve", "stations", ("setup",), GONE, ["in.yaml", "'setup'", "--setup eye-in"]),
    "setup-unknown": ("solve", "stations", ("setup",), "eye-on-hand", ["setup", "'eye-on-hand'"]),
    "units-unknown": ("solve", "stations", ("pose_units",), "cm", ["pose_units", "found 'cm'"]),
    "noise-negative": (
        "solve", "stations", ("noise",), {"robot_rotation_mrad": -1},
        ["noise.robot_rotation_mrad", "at least 0, found the number -1"],
    ),
    "noise-without-unit": (
        "solve", "stations", ("noise",), {"robot_rotation": 1},
        ["unknown key 'robot_rotation'", "did you mean 'robot_rotation_mrad'?"],
    ),
    "stations-a-mapping": ("solve", "stations", ("stations",), {}, ["expected a list, found no k"]),
    "schema-of-tomorrow": (
        "solve", "stations", ("schema",), "handeye/stations/2", ["schema", "found version 2"],
    ),
    "schema-misspelt": (
        "solve", "stations", ("schema",), "handeye/station/1", ["did you mean handeye/stations/1?"],
    ),
    "pixels-shorter-than-ids": (
        "extrinsics", "features", (*SECOND, "pixels"), lambda pixels: pixels[:-1],
        ["stations[1].ids", "found 36 ids, 35 pixels"],
    ),
    "pixel-nan": (
        "extrinsics", "features", (*SECOND, "pixels", 5, 1), float("nan"),
        ["stations[1].pixels[5][1]", "found nan"],
    ),
    "pixel-of-three-numbers": (
        "solve", "features", (*SECOND, "pixels", 5), [1, 2, 3],
        ["stations[1].pixels[5]", "expected two numbers u, v, found a list of 3"],
    ),
    "id-negative": ("solve", "features", (*SECOND, "ids", 0), -1, ["ids[0]", "the number -1"]),
    "id-out-of-range": (
        "extrinsics", "features", (*SECOND, "ids", 35), 36,
        ["in.yaml", 'station "01"', "36 points of the target", "found 36"],
    ),
    "id-twice": ("solve", "features", (*SECOND, "ids", 0), 34, ["found 34 more than once"]),
    "sigma-zero": ("solve", "features", (*SECOND, "sigma_px"), 0, ["sigma_px", "the number 0"]),
    "found-without-pixels": (
        "extrinsics", "features", (*SECOND, "pixels"), GONE, ["stations[1]", "ids and pixels"],
    ),
    "focal-length-zero": ("extrinsics", "features", ("camera", "fx"), 0, ["camera.fx", "above 0"]),
    "lens-unknown": (
        "extrinsics", "features", ("camera", "model"), "fisheye", ["camera.model", "'fisheye'"],
    ),
    "target-gone": ("extrinsics", "features", ("target",), GONE, ["in.yaml", "the key 'target'"]),
    "target-unknown": (
        "extract", "recording", ("target", "type"), "disk-grid",
        ["in.yaml: target", "found 'disk-grid'", "did you mean 'disc-grid'?"],
    ),
    "target-as-shorthand": (
        "extract", "recording", ("target",), "disc-grid:6x6:5mm:4mm",
        ["in.yaml: target", "expected a target", "found 'disc-grid:6x6:5mm:4mm'"],
    ),
    "target-of-touching-discs": (
        "solve", "features", ("target", "diameter_mm"), 5, ["below the spacing_mm of 5, found 5"],
    ),
    "target-key": (
        "extract", "recording", ("target", "spacing"), 5, ["target", "did you mean 'spacing_mm'?"],
    ),
    "image-size-a-fraction": (
        "extract", "recording", ("camera", "width"), 640.5, ["camera.width", "the number 640.5"],
    ),
    "image-gone": ("extract", "recording", (*SECOND, "image"), GONE, ["expected the key 'image'"]),
    "image-a-number": ("extract", "recording", (*SECOND, "image"), 1, ["image", "the number 1"]),
    "image-outside": (
        "solve", "recording", (*SECOND, "image"), "../../etc/passwd",
        ['stations[1].image (station "01")', "found '../../etc/passwd'", "--allow-outside"],
    ),
    "image-absolute": (
        "solve", "recording", (*SECOND, "image"), "/etc/passwd",
        ["expected an image inside the folder", "found '/etc/passwd'"],
    ),
    "a-calibration": (
        "solve", "calibration", ("method",), "tsai-lenz",
        ["in.yaml: expected a recording, features or stations document, found a calibration"],
    ),
    "features-to-extract": (
        "extract", "features", ("setup",), "eye-in-hand",
        ["in.yaml: expected a recording document, found a features document"],
    ),
    "stations-to-extrinsics": (
        "extrinsics", "stations", ("setup",), "eye-in-hand",
        ["expected a recording or features document, found a stations document"],
    ),
}  # fmt: skip
"""Command, kind of document, path of the fault, wrong value; parts of the message; all exit 3."""


@pytest.mark.parametrize("row", DOCUMENTS)
def test_a_document_with_one_fault(refused, good, tmp_path, row):
    command, kind, path, value, parts = DOCUMENTS[row]
    file = write(tmp_path / "in.yaml", edited(good[kind], path, value))
    refused([command, file], 3, parts)


HEADER = b"schema: handeye/stations/1\n"
BOMB = "".join(
    f"{name}: &{name} [{', '.join([value] * 10)}]\n"
    for name, value in zip("abcdefg", ["x", "*a", "*b", "*c", "*d", "*e", "*f"], strict=True)
)
CONTENTS = {
    "empty": (b"", ["expected a document, found nothing"]),
    "comment": (b"# later\n", ["expected a document, found nothing"]),
    "garbage": (bytes(range(256)), ["line 2", "expected UTF-8 text, found the byte 0x80"]),
    "brackets": (b"[" * 5000, ["column 61", "at most 60 levels of nesting"]),
    "braces": (b"{a: " * 500, ["at most 60 levels of nesting"]),
    "bomb": (BOMB.encode(), ["expected aliases for at most 100000 values, found more"]),
    "tag": (b"!!python/object/apply:os.abort []\n", ["found the tag", "os.abort"]),
    "duplicate-key": (HEADER + b"setup: a\nsetup: b\n", ["line 3", "'setup'", "in line 2"]),
    "tab": (HEADER + b"stations:\n\t- name: a\n", ["line 3, column 1", "not valid YAML"]),
    "two-documents": (HEADER + b"---\n" + HEADER, ["line 2", "the start of a second"]),
    "half-of-a-json": (b'{"schema": "handeye/stations/1", ', ["not valid YAML or JSON"]),
    "list": (b"- a\n- b\n", ["schema: handeye/stations/1, found a list of 2"]),
    "other-yaml": (b"image: a.png\n", ["schema: handeye/stations/1, found the keys image"]),
    "control-characters": (b'schema: "\\e[2J"\n', ["schema: expected handeye/", r"'\x1b[2J'"]),
    "picture": (b"\x89PNG\r\n\x1a\n", ["found the byte 0x89", "named in a recording document"]),
    "bare-nul": (HEADER + b"setup: \0\n", ["control characters are not allowed"]),
}  # fmt: skip


@pytest.mark.parametrize("row", CONTENTS)
def test_what_is_no_document(refused, tmp_path, row):
    content, parts = CONTENTS[row]
    file = tmp_path / "in.yaml"
    file.write_bytes(content)
    refused(["solve", file], 3, ["in.yaml", *parts])
    refused(["extrinsics", "-"], 3, ["standard input", *parts], stdin=content)


def test_a_recording_on_stdin(refused):
    parts = ["standard input", "0x89", "an MCAP recording cannot be read from a pipe"]
    refused(["solve", "-"], 3, parts, stdin=b"\x89MCAP0\r\n")
