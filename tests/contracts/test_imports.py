"""What every kind of foreign data must do: be recognised, give the truth, fail in plain words."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import scenes
from documents.foreign_files import FORMS, Shots

from handeye_cli import documents, pipeline, targets
from handeye_cli.conventions import MM, MRAD, Setup
from handeye_cli.documents import imports
from handeye_cli.documents.imports.foreign import Foreign
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3, station_generator
from handeye_cli.records import Camera, Noise, Recording, Stations
from handeye_cli.simulate import default_rig
from handeye_cli.simulate.recording import Rig, simulate_recording

NOISE = Noise(0.3 * MRAD, 0.1 * MM, 0.3 * MRAD, 0.1 * MM)
TARGET = targets.parse("chessboard:7x6:12mm")
CAMERA = Camera(400, 300, 420.0, 419.0, 201.0, 149.5)
MANY = 4.0
"""Times the predicted RMS: with six degrees of freedom a draw this far off is one in 10^15."""

POSES = [name for name, form in FORMS.items() if not form.pictures]
PICTURES = [name for name, form in FORMS.items() if form.pictures]


def posed(setup, count=10):
    """Noisy stations around a random answer, and that answer."""
    rng = np.random.default_rng(12)
    perfect = scenes.general_scene(rng, count)
    made = scenes.stations(rng, perfect, NOISE, setup=setup).stations
    robot = np.array([each.base_T_gripper for each in made])
    return Shots(setup, robot, np.array([each.camera_T_target.matrix for each in made])), perfect.X


@pytest.fixture(scope="module")
def pictured():
    """Pictures of a board from six stations, and where the camera really was on the gripper."""
    points = targets.build(TARGET).points()
    distance = default_rig.filling_distance(points, CAMERA)
    places = station_generator.generate_stations(6, distance, np.radians(30), points.mean(axis=0))
    roll = rotations.exp(np.linspace(-1.0, 1.0, 6)[:, None] * [0.0, 0.0, 1.0])
    setup = Setup.EYE_IN_HAND
    X, Z = default_rig.mount_T_camera(setup), default_rig.reference_T_target(setup)
    rig = Rig(TARGET, CAMERA, X, Z, setup, Noise(0.2 * MRAD, 0.1 * MM))
    made = simulate_recording(rig, places @ se3.from_parts(roll, np.zeros(3)), seed=4)
    stations = made.recording.stations
    pictures = tuple(each.image.load() for each in stations)
    robot = np.array([each.base_T_gripper for each in stations])
    return Shots(setup, robot, made.camera_T_target, pictures, CAMERA), X


def imported(name, shots, folder):
    """What is imported of one form, with what its format cannot say."""
    path, options = FORMS[name].write(shots, folder)
    if not FORMS[name].pictures:
        return imports.read(str(path), options)
    options = replace(options, target=options.target or TARGET, own_camera=True)
    made = imports.read(str(path), options)
    return replace(made, record=replace(made.record, camera=CAMERA))


def require_near(calibration, truth):
    off = se3.difference(calibration.mount_T_camera.matrix, truth)
    predicted = calibration.predicted_error
    assert np.linalg.norm(off[3:]) < MANY * predicted.rotation
    assert np.linalg.norm(off[:3]) < MANY * predicted.translation
    assert predicted.rotation < 2 * MRAD


def solved(record):
    return pipeline.to_calibration(
        record, pipeline.Steps(workers=1), method="maximum-likelihood", pairs="star"
    )


def test_every_kind_has_a_form():
    assert {form.kind for form in FORMS.values()} == set(imports.KINDS)


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("name", POSES)
def test_poses_come_back_and_solve_to_the_truth(name, setup, tmp_path):
    shots, truth = posed(setup)
    made = imported(name, shots, tmp_path)
    record = documents.as_written(made.record)
    assert made.kind == FORMS[name].kind
    assert isinstance(record, Stations)
    assert record.setup is setup
    robot = np.array([station.base_T_gripper for station in record.stations])
    camera = np.array([station.camera_T_target.matrix for station in record.stations])
    np.testing.assert_allclose(robot, shots.base_T_gripper, atol=1e-12)
    np.testing.assert_allclose(camera, shots.camera_T_target, atol=1e-12)
    require_near(solved(record), truth)


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_keep_their_poses_and_solve_to_the_truth(name, pictured, tmp_path):
    shots, truth = pictured
    record = imported(name, shots, tmp_path).record
    assert isinstance(record, Recording)
    assert record.target == TARGET
    robot = np.array([station.base_T_gripper for station in record.stations])
    np.testing.assert_allclose(robot, shots.base_T_gripper, atol=1e-12)
    for station, picture in zip(record.stations, shots.pictures, strict=True):
        np.testing.assert_array_equal(station.image.load(), picture)
    written = tmp_path / "recording.yaml"
    documents.write(record, str(written))
    require_near(solved(documents.read(str(written))), truth)


@pytest.mark.parametrize("name", FORMS)
def test_a_file_is_of_its_own_kind_alone(name, pictured, tmp_path):
    path, _ = FORMS[name].write(pictured[0], tmp_path)
    foreign = Foreign(str(path))
    modules = {kind: import_module(row.module) for kind, row in imports.KINDS.items()}
    found = [kind for kind, module in modules.items() if module.recognises(foreign)]
    assert found == [FORMS[name].kind]


@pytest.mark.parametrize("name", FORMS)
def test_every_file_read_is_remembered(name, pictured, tmp_path):
    made = imported(name, pictured[0], tmp_path)
    names = [file for file, _ in made.files]
    assert names
    assert len(set(names)) == len(names)
    assert all(len(digest) == 64 for _, digest in made.files)


def broken(content, rng):
    """Yield a file cut off, and with bytes, numbers and words of it changed."""
    for share in (0.0, 0.2, 0.5, 0.9, 0.99):
        yield content[: int(share * len(content))]
    for _ in range(25):
        spoiled = bytearray(content)
        at = int(rng.integers(len(content)))
        spoiled[at] = int(rng.integers(256))
        yield bytes(spoiled)
    for old, new in ((b"0.", b".nan"), (b"0.", b"1e400"), (b"-", b"x"), (b":", b""), (b"[", b"")):
        yield content.replace(old, new, 1)
        yield content.replace(old, new)


@pytest.mark.parametrize("name", FORMS)
def test_a_broken_file_is_refused_in_plain_words_or_read(name, pictured, tmp_path):
    """Nothing but an InputError comes out, whatever is in the file, and it names a file."""
    shots, _ = pictured
    few = replace(
        shots,
        base_T_gripper=shots.base_T_gripper[:3],
        camera_T_target=shots.camera_T_target[:3],
        pictures=shots.pictures[:3],
    )
    path, options = FORMS[name].write(few, tmp_path)
    options = replace(options, target=TARGET, own_camera=name != "visp-images")
    texts = [each for each in tmp_path.rglob("*") if each.suffix not in (".png", "") and
             each.is_file()]  # fmt: skip
    victim = next(each for each in sorted(texts) if path.is_dir() or each == path)
    content, refused = victim.read_bytes(), []
    for spoiled in broken(content, np.random.default_rng(7)):
        victim.write_bytes(spoiled)
        try:
            imports.read(str(path), options, FORMS[name].kind)
        except InputError as error:
            refused.append(error)
    assert len(refused) > 5
    assert [str(error) for error in refused if str(tmp_path) not in str(error.where)] == []


def test_help_lists_every_kind():
    from handeye_cli.cli.grouping import flags_of
    from handeye_cli.cli.import_options import ForeignKind

    text = flags_of(ForeignKind)["kind"][1].settings["help"]
    assert [kind for kind in imports.KINDS if kind not in text] == []
