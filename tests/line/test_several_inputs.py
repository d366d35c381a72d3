"""Several inputs on a command line: files of one recording, and what they must not be."""

import hashlib
import json

import pytest
from line.recordings import RecordedRobot
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recording.bags import Robot, write

PLATE = ["--setup", "eye-in-hand", "--target", "disc-grid:6x6:5mm:4mm"]


def halves(folder, messages):
    """Write two files, the one with the later name first in time; return them and both in one."""
    middle = len(messages) // 2
    first, second = folder / "part_10.mcap", folder / "part_2.mcap"
    write(first, messages[:middle], chunk_size=1_000_000)
    write(second, messages[middle:], chunk_size=1_000_000)
    return first, second, write(folder / "whole.mcap", messages, chunk_size=1_000_000)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A robot that sees nothing."""
    return halves(tmp_path_factory.mktemp("small"), Robot(stations=2, image_rate=5.0).messages())


def document_of(handeye, *words):
    done = handeye(*words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out), done.err


def inputs_of(files):
    return [
        {"file": str(each), "sha256": hashlib.sha256(each.read_bytes()).hexdigest()}
        for each in files
    ]


def test_files_named_one_by_one_give_the_answer_of_one_file(handeye, tmp_path):
    first, second, whole = halves(tmp_path, RecordedRobot().messages())
    answer = tmp_path / "answer.mcap"
    document, said = document_of(handeye, "solve", second, first, *PLATE, "--mcap", answer)
    assert f"2 files in this order: {first}, {second}" in said
    (step,) = document["provenance"]
    assert step["inputs"] == inputs_of([second, first])
    assert step["options"].keys() == {"setup", "target"}
    expected, _ = document_of(handeye, "solve", whole, *PLATE)
    for each in (expected, document):
        del each["provenance"], each["diagnosis"]
    assert document == expected
    assert_in_the_frames_of_the_robot(answer, document)


def assert_in_the_frames_of_the_robot(path, document):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        ((_, _, _, message),) = reader.iter_decoded_messages()
    camera, target = message.transforms
    assert (camera.header.frame_id, camera.child_frame_id) == ("tool", "camera_optical")
    assert (target.header.frame_id, target.child_frame_id) == ("world", "target")
    t = camera.transform.translation
    assert [t.x, t.y, t.z] == document["gripper_T_camera"]["translation"]


def test_extract_takes_them_too(handeye, small):
    document, _ = document_of(handeye, "extract", small[1], small[0], *PLATE)
    expected, _ = document_of(handeye, "extract", small[2], *PLATE)
    assert document["stations"] == expected["stations"]
    assert document["provenance"][0]["inputs"] == inputs_of(small[1::-1])


def test_inspect_says_how_to_go_on_with_them(handeye, small):
    document, _ = document_of(handeye, "inspect", small[0], small[1])
    assert document["recording"]["command"] == (
        f"handeye solve {small[0]} {small[1]} --setup WHERE --target SPEC"
    )
    assert len(document["recording"]["pauses"]) == 2
    assert document["provenance"][0]["inputs"] == inputs_of(small[:2])


@pytest.mark.parametrize("command", ["extract", "extrinsics", "solve", "verify", "inspect"])
@pytest.mark.parametrize(
    ("names", "odd"),
    [
        (["a.yaml", "b.yaml"], "a.yaml"),
        (["part_10.mcap", "b.yaml"], "b.yaml"),
        (["-", "part_10.mcap"], "-"),
    ],
)
def test_documents_are_read_one_at_a_time(refused, small, command, names, odd):
    folder = small[0].parent
    words = [name if name == "-" else folder / name for name in names]
    odd = odd if odd == "-" else folder / odd
    found = f"found 2 inputs, of which {odd} is no MCAP file"
    refused([command, *words], 2, ["expected one document, or several MCAP files", found])


def test_a_file_that_is_named_twice(refused, small):
    refused(["solve", small[0], small[0], *PLATE], 2, ["found one of them twice", str(small[0])])


def test_what_is_wrong_with_them_is_said_of_all(refused, small):
    refused(["solve", *small[:2], *PLATE], 4, [f"{small[0]} and 1 more: "])


def test_a_setup_is_needed(refused, small):
    refused(["solve", *small[:2]], 3, [f"{small[0]} and 1 more: expected to be told"])
