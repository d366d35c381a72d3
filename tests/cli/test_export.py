"""`handeye export`: the answer for other software, from a calibration or from what leads to it."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from cli.scene import TRUTH
from recording import bags, ros2
from scipy.spatial.transform import Rotation

from handeye_cli import documents
from handeye_cli.cli.export_mount import mount_pose
from handeye_cli.cli.export_options import Frames
from handeye_cli.cli.options import Source
from handeye_cli.documents import exports
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.records.free import FreeDirection, PosePart

FRAMES = ["--parent", "tool0", "--child", "camera_optical_frame"]
LINK = "0,0.0175,0.0125,-0.5,0.5,-0.5,0.5"
LINK_T_OPTICAL = se3.from_parts(
    Rotation.from_quat([-0.5, 0.5, -0.5, 0.5]).as_matrix(), np.array([0.0, 0.0175, 0.0125])
)


@pytest.fixture
def tf_file(tmp_path):
    """A recording with nothing but the camera's own frames."""
    numbers = bags.pose_numbers(LINK_T_OPTICAL)
    payload = ros2.transforms((bags.ns(0), "camera_link", "camera_optical_frame", numbers))
    message = (bags.ns(0), "/tf_static", "tf2_msgs/msg/TFMessage", payload)
    return bags.write(tmp_path / "tf.mcap", [message])


def answer_of(path):
    pose = yaml.safe_load(path.read_text())["gripper_T_camera"]
    R = Rotation.from_quat(pose["quaternion"]).as_matrix()
    return se3.from_parts(R, np.array(pose["translation"]))


def joint_pose(text):
    joint = ElementTree.fromstring(text)
    origin = joint.find("origin")
    R = Rotation.from_euler("xyz", [float(each) for each in origin.get("rpy").split()])
    T = se3.from_parts(R.as_matrix(), np.array([float(x) for x in origin.get("xyz").split()]))
    return T, joint.find("parent").get("link"), joint.find("child").get("link")


def rows(text):
    return np.array([[float(each) for each in line.split(",")] for line in text.splitlines()])


@pytest.mark.parametrize("name", exports.FORMATS)
def test_every_format_goes_to_stdout_and_to_a_file(handeye, calibration_file, tmp_path, name):
    done = handeye("export", calibration_file, "--to", name, *FRAMES)
    assert (done.code, done.err) == (0, "")
    shown = handeye("export", calibration_file, "--to", name, *FRAMES, terminal=True)
    assert shown.out == done.out
    path = tmp_path / f"handeye{exports.FORMATS[name].suffix}"
    written = handeye("export", calibration_file, "--to", name, *FRAMES, "-o", path)
    assert (written.code, written.out) == (0, "")
    assert path.read_text() == done.out


def test_the_matrix_is_the_answer(handeye, calibration_file):
    done = handeye("export", calibration_file, "--to", "csv")
    np.testing.assert_allclose(rows(done.out), answer_of(calibration_file), atol=1e-15)
    np.testing.assert_allclose(rows(done.out), TRUTH, atol=1e-3)


def test_what_is_missing_is_run(handeye, stations_file, calibration_file):
    direct = handeye("export", stations_file, "--to", "csv")
    by_way = handeye("export", calibration_file, "--to", "csv")
    assert (direct.code, direct.out) == (0, by_way.out)
    tsai = handeye("export", stations_file, "--to", "csv", "--method", "tsai-lenz")
    assert tsai.code == 0
    assert tsai.out != direct.out


def test_a_calibration_from_a_pipe(handeye, calibration_file):
    content = calibration_file.read_bytes()
    done = handeye("export", "-", "--to", "csv", stdin=content)
    assert done.out == handeye("export", calibration_file, "--to", "csv").out


@pytest.mark.parametrize("way", ["numbers", "file", "tf"])
def test_the_mount_link(handeye, calibration_file, tf_file, tmp_path, way):
    pose = tmp_path / "link.yaml"
    pose.write_text("translation: [0, 0.0175, 0.0125]\nquaternion: [-0.5, 0.5, -0.5, 0.5]\n")
    given = {"numbers": LINK, "file": pose, "tf": tf_file}[way]
    done = handeye("export", calibration_file, "--to", "urdf", *FRAMES,
                   "--mount-frame", "camera_link", "--mount-T-optical", given)  # fmt: skip
    assert (done.code, done.err) == (0, "")
    tool_T_link, parent, child = joint_pose(done.out)
    assert (parent, child) == ("tool0", "camera_link")
    tool_T_optical = answer_of(calibration_file)
    np.testing.assert_allclose(tool_T_link @ LINK_T_OPTICAL, tool_T_optical, atol=1e-12)


def test_the_link_of_a_recording_is_in_its_own_tf(tf_file):
    frames = Frames(child="camera_optical_frame", mount_frame="camera_link")
    source = Source(str(tf_file))
    np.testing.assert_allclose(mount_pose(frames, source), LINK_T_OPTICAL, atol=1e-15)


def static_link(path, seconds, parent, child, pose):
    payload = ros2.transforms((bags.ns(seconds), parent, child, bags.pose_numbers(pose)))
    message = (bags.ns(seconds), "/tf_static", "tf2_msgs/msg/TFMessage", payload)
    return str(bags.write(path, [message]))


def test_the_link_is_looked_for_in_all_files_of_a_recording(tmp_path):
    """Each of two files holds one half of the way from the link to the optical frame."""
    first = static_link(tmp_path / "0.mcap", 0, "camera_link", "lens", LINK_T_OPTICAL)
    second = static_link(tmp_path / "1.mcap", 1, "lens", "camera_optical_frame", np.eye(4))
    frames = Frames(child="camera_optical_frame", mount_frame="camera_link")
    source = Source(first, further=[second])
    np.testing.assert_allclose(mount_pose(frames, source), LINK_T_OPTICAL, atol=1e-15)
    with pytest.raises(InputError, match="found 'cam_link'") as caught:
        mount_pose(replace(frames, mount_frame="cam_link"), source)
    assert caught.value.where == f"{first} and 1 more: --mount-frame"


def test_easy_handeye2_files_it_under_the_name_of_the_file(handeye, calibration_file, tmp_path):
    path = tmp_path / "cell_4.calib"
    words = ["export", calibration_file, "--to", "easy-handeye2", *FRAMES, "-o", path]
    assert handeye(*words).code == 0
    assert yaml.safe_load(path.read_text())["parameters"]["name"] == "cell_4"
    again = handeye(*words)
    assert (again.code, "exists already" in again.err) == (2, True)
    assert handeye(*words, "--force").code == 0


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--to", "urfd", *FRAMES], 2, "did you mean urdf?"),
        (["--to", "urdf", "--parent", "tool0"], 2, "--child camera_optical_frame"),
        (["--to", "urdf", "--child", "camera"], 2, "--parent tool0"),
        (["--to", "urdf", "--child", "/camera", "--parent", "tool0"], 2, "found '/camera'"),
        (["--to", "csv", "--method", "li"], 2, "--method cannot act on a calibration"),
        (["--to", "csv", "--calibrate-intrinsics"], 2, "--calibrate-intrinsics cannot act"),
        (["--to", "easy-handeye2", *FRAMES, "-o", "a.yaml"], 2, "found 'a.yaml'"),
        (["--to", "zivid", "--mount-frame", "camera_link"], 2, "optical frame for zivid"),
        (["--to", "urdf", *FRAMES, "--mount-frame", "camera_link"], 2, "has no TF"),
        (["--to", "urdf", *FRAMES, "--mount-T-optical", LINK], 2, f"--mount-T-optical {LINK}"),
        (["--to", "csv", "--mount-frame", "l", "--mount-T-optical", "1,2"], 2, "found 2: 1,2"),
        (["--to", "csv", "--mount-frame", "l", "--mount-T-optical", "no.yaml"], 3, "no.yaml"),
        (["--to", "csv", "--mount-frame", "l", "--mount-T-optical", "a.mcap"], 2, "--child"),
    ],
)
def test_what_cannot_be_exported(handeye, calibration_file, words, code, message):
    done = handeye("export", calibration_file, *words)
    assert (done.code, done.out) == (code, "")
    assert message in done.err


def test_a_document_is_no_pose_of_a_link(handeye, calibration_file):
    done = handeye("export", calibration_file, "--to", "csv",
                   "--mount-frame", "link", "--mount-T-optical", calibration_file)  # fmt: skip
    assert (done.code, done.out) == (3, "")
    assert "expected --mount-T-optical to be a pose, found a document" in done.err


def test_a_frame_that_tf_does_not_have(handeye, calibration_file, tf_file):
    done = handeye("export", calibration_file, "--to", "urdf", *FRAMES,
                   "--mount-frame", "camera_lnk", "--mount-T-optical", tf_file)  # fmt: skip
    assert (done.code, done.out) == (3, "")
    assert "tf.mcap: --mount-frame: expected a frame of the recording, found 'camera_lnk'" in (
        done.err
    )
    assert "did you mean 'camera_link'?" in done.err


def test_help_names_every_format(handeye, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    done = handeye("export", "--help")
    words = set(re.findall(r"[a-z0-9-]+", done.out))
    assert words >= exports.FORMATS.keys()
    assert max(map(len, done.out.splitlines())) <= 80


FREE = "translation along the gripper's z axis"
NEEDS_ALL = {
    "export": ["export", "partial.yaml", "--to", "csv"],
    "verify": ["verify", "stations.json", "--calibration", "partial.yaml"],
    "batch": ["batch", "stations.json", "--calibration", "partial.yaml"],
    "plan": ["plan", "--stations", "5", "--calibration", "partial.yaml"],
    "simulate": ["simulate", "recording", "--calibration", "partial.yaml", "-o", "made"],
}


@pytest.mark.parametrize("command", NEEDS_ALL)
def test_a_partial_answer_is_none_to_go_by(
    handeye, calibration_file, tmp_path, monkeypatch, command
):
    free = FreeDirection(PosePart.TRANSLATION, np.array([0.0, 0.0, 1.0]), "gripper", FREE)
    path = str(tmp_path / "partial.yaml")
    documents.write(replace(documents.read(str(calibration_file)), free=(free,)), path)
    monkeypatch.chdir(tmp_path)
    done = handeye(*NEEDS_ALL[command])
    assert (done.code, done.out) == (3, "")
    assert done.err == (
        "error: partial.yaml: expected a whole answer, found a partial one, which leaves free: "
        f"{FREE}\nhint: add stations that determine it, and solve without --partial\n"
    )
    assert not (tmp_path / "made").exists()
