"""`handeye solve --mcap`: the answer as transforms, beside the document."""

import json

import numpy as np
import pytest
import yaml
from cli.scene import pose, stations_document
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from handeye_cli.geometry import rotations, se3
from handeye_cli.recording import survey


def messages(path, **options):
    with path.open("rb") as file:
        return list(make_reader(file, **options).iter_decoded_messages())


def links(path):
    """Every link of a file as our own reader of TF has it: frames, and seven numbers."""
    found = survey.take(str(path)).links
    assert all(link.static for link in found)
    return {(link.parent, link.child): link.numbers[-1].tolist() for link in found}


def written(pose):
    return [*pose["translation"], *pose["quaternion"]]


@pytest.fixture
def solved(handeye, stations_file, tmp_path):
    """Solve with some flags and return the document and the path of the transforms."""

    def solve(*flags, file=stations_file):
        document, answer = tmp_path / "calibration.yaml", tmp_path / "answer.mcap"
        done = handeye("solve", file, "-o", document, "--mcap", answer, "--force", *flags)
        assert (done.code, done.out) == (0, ""), done.err
        return yaml.safe_load(document.read_text()), answer

    return solve


def test_ros_reads_the_numbers_of_the_document(solved):
    document, answer = solved()
    ((schema, channel, sent, message),) = messages(answer, decoder_factories=[DecoderFactory()])
    assert (schema.name, channel.topic) == ("tf2_msgs/msg/TFMessage", "/tf_static")
    assert "durability: 1" in channel.metadata["offered_qos_profiles"]
    assert sent.log_time == 0
    camera, target = message.transforms
    assert (camera.header.frame_id, camera.child_frame_id) == ("gripper", "camera_optical")
    assert (target.header.frame_id, target.child_frame_id) == ("base", "target")
    for found, key in [(camera, "gripper_T_camera"), (target, "base_T_target")]:
        t, q = found.transform.translation, found.transform.rotation
        assert [t.x, t.y, t.z] == document[key]["translation"]
        assert [q.x, q.y, q.z, q.w] == pytest.approx(document[key]["quaternion"], abs=1e-15)


@pytest.mark.parametrize("form", ["ros2", "foxglove"])
def test_the_answer_can_be_read_as_transforms_again(solved, form):
    document, answer = solved("--mcap-form", form)
    found = links(answer)
    assert found.keys() == {("gripper", "camera_optical"), ("base", "target")}
    for frames, key in zip(found, ["gripper_T_camera", "base_T_target"], strict=True):
        np.testing.assert_allclose(found[frames], written(document[key]), atol=1e-15)


def test_beside_the_robot_the_camera_hangs_on_the_base(solved, tmp_path):
    file = tmp_path / "eye-to-hand.json"
    data = stations_document(10)
    for station in data["stations"]:
        # the inverse poses make the same equations those of a camera beside the robot
        given = station["base_T_gripper"]
        R = rotations.matrix_from_quaternion(np.array(given["quaternion"]))
        T = se3.from_parts(R, np.array(given["translation"]))
        station["base_T_gripper"] = pose(se3.inverse(T))
    file.write_text(json.dumps(data | {"setup": "eye-to-hand"}))
    document, answer = solved(file=file)
    found = links(answer)
    assert found.keys() == {("base", "camera_optical"), ("gripper", "target")}
    for frames, key in zip(found, ["base_T_camera", "gripper_T_target"], strict=True):
        np.testing.assert_allclose(found[frames], written(document[key]), atol=1e-15)


def test_frames_are_named_by_flags(solved):
    _, answer = solved("--parent-frame", "/tool0", "--child-frame", "wrist_camera")
    assert links(answer).keys() == {("tool0", "wrist_camera"), ("base", "target")}


def test_the_document_does_not_depend_on_the_transforms(handeye, stations_file, solved):
    document, _ = solved("--child-frame", "eye")
    assert document == yaml.safe_load(handeye("solve", stations_file).out)


def test_the_same_answer_gives_the_same_bytes(solved):
    first = solved()[1].read_bytes()
    assert solved()[1].read_bytes() == first


def test_a_file_that_exists_is_kept(handeye, stations_file, tmp_path):
    answer, document = tmp_path / "answer.mcap", tmp_path / "calibration.yaml"
    answer.write_bytes(b"precious")
    done = handeye("solve", stations_file, "-o", document, "--mcap", answer)
    assert (done.code, done.out) == (2, "")
    assert f"{answer}: the file exists already" in done.err
    assert answer.read_bytes() == b"precious"
    assert not document.exists()
    assert handeye("solve", stations_file, "--mcap", answer, "--force").code == 0
    assert len(links(answer)) == 2


REFUSED = {
    "no-file": (["--parent-frame", "tool0"], "--parent-frame acts on --mcap only"),
    "no-form": (["--mcap-form", "foxglove"], "--mcap-form acts on --mcap only"),
    "partial": (["--mcap", "{0}/a.mcap", "--partial"], "expected --mcap or --partial, found both"),
    "stdout": (["--mcap", "-"], "expected --mcap to be the name of a file, found '-'"),
    "input": (
        ["--mcap", "{0}/stations.json", "--force"],
        "{0}/stations.json, which is the input",
    ),
    "document": (
        ["-o", "{0}/a.json", "--mcap", "{0}/../{1}/a.json"],
        "{0}/../{1}/a.json, which is the document",
    ),
    "same-names": (
        ["--mcap", "{0}/a.mcap", "--parent-frame", "eye", "--child-frame", "eye"],
        "found 'eye', 'base', 'eye', 'target'",
    ),
    "reserved": (
        ["--mcap", "{0}/a.mcap", "--child-frame", "target"],
        "found 'gripper', 'base', 'target', 'target'",
    ),
    "nameless": (
        ["--mcap", "{0}/a.mcap", "--parent-frame", "/"], "found '', 'base', 'camera_optical'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("row", REFUSED)
def test_flags_that_make_no_sense_are_refused(handeye, stations_file, tmp_path, row):
    flags, said = REFUSED[row]
    names = [tmp_path, tmp_path.name]
    before = stations_file.read_bytes()
    done = handeye("solve", stations_file, *[flag.format(*names) for flag in flags])
    assert (done.code, done.out) == (2, "")
    assert said.format(*names) in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["stations.json"]
    assert stations_file.read_bytes() == before


def test_a_folder_that_does_not_exist(handeye, stations_file, tmp_path):
    done = handeye("solve", stations_file, "--mcap", tmp_path / "none" / "a.mcap")
    assert done.code == 3
    assert f"{tmp_path / 'none'}: expected an existing folder" in done.err
