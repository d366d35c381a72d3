"""The interface of the package: the contract's minimal forms, flags, standard input, files."""

from __future__ import annotations

import hashlib
import io
import json
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from documents import samples

from handeye_cli import documents
from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup
from handeye_cli.documents import ReadOptions, files
from handeye_cli.errors import InputError, UsageError

RECORDING = """
schema: handeye/recording/1
setup: eye-in-hand
target: {type: disc-grid, rows: 6, columns: 6, spacing_mm: 5, diameter_mm: 4}
camera: {width: 640, height: 480, fx: 550, fy: 550, cx: 320, cy: 240, distortion: [0, 0, 0, 0, 0]}
stations:
  - image: images/0.png
    base_T_gripper: {translation: [0.1, 0.2, 0.3], quaternion: [0, 0, 0, 1]}
"""
STATIONS = """
schema: handeye/stations/1
stations:
  - base_T_gripper: {translation: [100, 200, 300], quaternion: [1, 0, 0, 0]}
    camera_T_target: {translation: [0, 0, 500], quaternion: [1, 0, 0, 0]}
  - name: 07
    base_T_gripper: {translation: [0, 0, 0], quaternion: [0, 1, 0, 0]}
    reason: not found
"""


def read_text(text, **flags):
    return documents.read("-", ReadOptions(**flags), io.BytesIO(text.encode()))


def write_recording(folder, image):
    path = folder / "recording.yaml"
    path.write_text(RECORDING.replace("images/0.png", image))
    return str(path)


def test_minimal_recording(tmp_path):
    recording = documents.read(write_recording(tmp_path, "images/0.png"))
    assert recording.setup is Setup.EYE_IN_HAND
    assert recording.target.type == "disc-grid"
    assert recording.target.parameters["spacing_mm"] == 5
    assert recording.camera.parameters.tolist() == [550, 550, 320, 240, 0, 0, 0, 0, 0]
    (station,) = recording.stations
    assert station.name == "0"
    assert station.base_T_gripper[:3, 3].tolist() == [0.1, 0.2, 0.3]
    assert station.image.path == (tmp_path / "images" / "0.png").resolve()
    # the picture is missing, which is for those to say who look at it
    with pytest.raises(InputError, match="No such file"):
        station.image.load()


def test_minimal_stations_need_the_setup_from_a_flag():
    with pytest.raises(InputError, match="--setup eye-in-hand"):
        read_text(STATIONS)
    record = read_text(STATIONS, setup=Setup.EYE_TO_HAND)
    assert record.setup is Setup.EYE_TO_HAND
    assert [station.name for station in record.stations] == ["00", "07"]
    assert record.stations[1].camera_T_target is None
    assert record.stations[1].reason == "not found"


def test_conventions_of_the_document_and_flags_that_win():
    flags = {
        "setup": Setup.EYE_IN_HAND,
        "pose_units": PoseUnits.MM,
        "quaternion_order": QuaternionOrder.WXYZ,
        "robot_poses": RobotPoses.BASE_IN_GRIPPER,
    }
    said = "pose_units: mm\nquaternion_order: wxyz\nrobot_poses: base-in-gripper\n"
    denied = "pose_units: m\nquaternion_order: xyzw\nrobot_poses: gripper-in-base\n"
    for text, options in (
        (STATIONS + said, {"setup": Setup.EYE_IN_HAND}),
        (STATIONS + denied + "setup: eye-to-hand\n", flags),
    ):
        first = read_text(text, **options).stations[0]
        # inverted because the robot's poses were, and only they
        np.testing.assert_allclose(first.base_T_gripper[:3, 3], [-0.1, -0.2, -0.3], atol=1e-16)
        np.testing.assert_allclose(first.camera_T_target.matrix[:3, 3], [0, 0, 0.5], atol=1e-16)
        np.testing.assert_array_equal(first.camera_T_target.matrix[:3, :3], np.eye(3))


@pytest.mark.parametrize("image", ["../0.png", "/etc/hostname", "a/../../0.png", "link/0.png"])
def test_images_outside_the_folder_are_refused_unless_allowed(tmp_path, image):
    folder = tmp_path / "recording"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    source = write_recording(folder, image)
    with pytest.raises(InputError, match="inside the folder") as caught:
        documents.read(source)
    assert repr(image) in caught.value.message
    assert "--allow-outside" in caught.value.hint
    allowed = documents.read(source, ReadOptions(allow_outside=True))
    assert allowed.stations[0].image.path == (folder / image).resolve()


def test_an_image_path_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match="expected the path of an image") as caught:
        documents.read(write_recording(tmp_path, '"a\\0b.png"'))
    assert "stations[0].image" in caught.value.where


def test_images_with_the_same_stem_need_names(tmp_path):
    entry = RECORDING[RECORDING.index("  - image") :]
    path = tmp_path / "recording.yaml"
    path.write_text(RECORDING + entry.replace("images/0.png", "others/0.png"))
    with pytest.raises(InputError, match="found '0' at 0 and at 1"):
        documents.read(str(path))


def test_source_knows_name_and_digest_and_reads_standard_input_once(tmp_path):
    content = (STATIONS + "setup: eye-in-hand\n").encode()
    stream = io.BytesIO(content)
    source = documents.read_source("-", stdin=stream)
    assert stream.read() == b""
    assert (source.name, source.sha256) == ("-", hashlib.sha256(content).hexdigest())
    path = tmp_path / "stations.yaml"
    path.write_bytes(content)
    again = documents.read_source(str(path))
    assert (again.name, again.sha256) == (str(path), source.sha256)
    samples.assert_same(again.record, source.record)


def test_a_pipe_can_be_read(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=["schema: 3"])
    writer.start()
    with pytest.raises(InputError, match="found the number 3"):
        documents.read(str(pipe))
    writer.join()


@pytest.mark.parametrize(
    ("name", "reason"), [("missing.yaml", "No such file"), ("", "directory"), ("a\0b", "null")]
)
def test_unreadable_files_are_named(tmp_path, name, reason):
    source = str(tmp_path / name) if name else str(tmp_path)
    with pytest.raises(InputError, match=reason) as caught:
        documents.read(source)
    assert caught.value.where == source


def test_an_endless_stream_ends(monkeypatch):
    monkeypatch.setattr(files, "MAX_BYTES", 1000)
    assert len(files.read_bytes("/dev/zero")) == 1001


def test_form_follows_the_ending(tmp_path):
    record = samples.verification(np.random.default_rng(0))
    documents.write(record, str(tmp_path / "a.JSON"))
    assert json.loads((tmp_path / "a.JSON").read_text())["schema"] == "handeye/verification/1"
    documents.write(record, str(tmp_path / "a.txt"))
    assert (tmp_path / "a.txt").read_text().startswith("schema: handeye/verification/1\n")


def test_an_existing_file_is_replaced_only_with_force(tmp_path):
    path = tmp_path / "out.yaml"
    documents.write_text("old", str(path))
    path.chmod(0o640)
    with pytest.raises(UsageError, match="exists already") as caught:
        documents.write_text("new", str(path))
    assert "--force" in caught.value.hint
    assert path.read_text() == "old"
    documents.write_text("new", str(path), force=True)
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.yaml"]


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link.yaml").symlink_to(tmp_path / "there" / "real.yaml")
    documents.write_text("new", str(tmp_path / "link.yaml"))
    assert (tmp_path / "link.yaml").is_symlink()
    assert (tmp_path / "there" / "real.yaml").read_text() == "new"


def test_a_file_system_without_hard_links_will_do(tmp_path, monkeypatch):
    def refuse(self: Path, target: Path) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "hardlink_to", refuse)
    documents.write_text("new", str(tmp_path / "out.yaml"))
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["new"]


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    path = tmp_path / "out.yaml"
    path.write_text("old")

    def fail(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match="No space left on device"):
        documents.write_text("new", str(path), force=True)
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["old"]


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("missing/out.yaml", InputError, "No such file"),
        ("", UsageError, "found a folder"),
        ("/dev/null", UsageError, "found a device"),
        ("a\0b", InputError, "null"),
    ],
)
def test_places_that_cannot_be_written(tmp_path, name, error, message):
    with pytest.raises(error, match=message):
        documents.write_text("x", str(tmp_path / name), force=True)


def test_reading_imports_no_heavy_module(tmp_path):
    path = tmp_path / "stations.yaml"
    documents.write(samples.stations(np.random.default_rng(0)), str(path))
    program = (
        "import sys; from handeye_cli import documents\n"
        f"documents.read({str(path)!r})\n"
        "print([name for name in ('cv2', 'scipy', 'mcap', 'rich') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
