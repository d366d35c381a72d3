"""`handeye simulate recording`: what it writes, that the line takes it, and what it refuses."""

import json
import time

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader

from handeye_cli import documents, recording
from handeye_cli.cli.grouping import flags_of
from handeye_cli.cli.simulate_recording_options import Scenery
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.recording import McapOptions
from handeye_cli.simulate.faults import FAULTS

HALF = ("--width", 320, "--height", 240, "--focal-px", 275)
"""Pictures of a camera with half the pixels each way, in which the plate is found."""
SMALL = ("--width", 80, "--height", 60, "--focal-px", 70, "--stations", 4)
"""Pictures that take no time; nothing is to be found in them."""
RUN = ("--rate", 2, "--pause", "600ms", "--tf-rate", 50)
"""A robot's run with a picture or two in each pause, and some on the way."""
QUICK = (*SMALL, *RUN)


@pytest.fixture
def simulate(handeye):
    """Run the command."""
    return lambda *words, **how: handeye("simulate", "recording", *words, **how)


@pytest.fixture
def refused(simulate, tmp_path):
    """Run a line that must fail and leave nothing behind."""

    def run(*words, code, parts):
        before = sorted(tmp_path.rglob("*"))
        done = simulate(*SMALL, *words)
        assert (done.code, done.out) == (code, ""), done.err
        assert [part for part in parts if part not in done.err] == [], done.err
        assert sorted(tmp_path.rglob("*")) == before

    return run


def matrix(pose):
    R = rotations.matrix_from_quaternion(np.array(pose["quaternion"]))
    return se3.from_parts(R, np.array(pose["translation"]))


def loaded(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def images(folder):
    return {path.name: path.read_bytes() for path in (folder / "images").iterdir()}


def as_read(path, offset_ns=0):
    options = McapOptions(setup=Setup.EYE_IN_HAND, time_offset_ns=offset_ns)
    return recording.read(str(path), options)


def test_document_and_mcap_of_one_seed_give_one_answer_as_near_as_it_says(
    simulate, handeye, tmp_path
):
    """Six stations, from nothing to a checked answer."""
    words = (*HALF, "--stations", 6, "--seed", 3)
    begin = time.process_time()
    done = simulate(*words, "-o", tmp_path / "made", "--truth", tmp_path / "truth.yaml")
    assert (done.code, done.out, done.err) == (0, "", "")
    assert simulate(*words, *RUN, "-o", tmp_path / "made.mcap").code == 0
    assert time.process_time() - begin < 4.0  # 0.8 on an idle machine
    truth = loaded(tmp_path / "truth.yaml")
    flags = ("--setup", "eye-in-hand", "--target", "disc-grid:6x6:5mm:4mm")
    for source in (["made/recording.yaml"], ["made.mcap", *flags]):
        done = handeye("solve", tmp_path / source[0], *source[1:], "-o", "-", "--json")
        assert done.code == 0, done.err
        answer = json.loads(done.out)
        names = [station["name"] for station in answer["stations"]]
        assert names == [station["name"] for station in truth["stations"]]
        assert all(station["used"] for station in answer["stations"])
        apart = se3.difference(
            matrix(answer["gripper_T_camera"]), matrix(truth["gripper_T_camera"])
        )
        predicted = answer["predicted_error"]
        assert 1e3 * np.linalg.norm(apart[3:]) < predicted["rotation_95_mrad"] < 1.0
        assert 1e3 * np.linalg.norm(apart[:3]) < predicted["translation_95_mm"] < 0.5
    told = [station.base_T_gripper for station in as_read(tmp_path / "made.mcap").stations]
    written = documents.read(str(tmp_path / "made" / "recording.yaml")).stations
    for pose, station in zip(told, written, strict=True):
        assert pose == pytest.approx(station.base_T_gripper, abs=1e-9)


def test_the_same_seed_gives_the_same_bytes(simulate, tmp_path):
    for name, seed in (("one", 1), ("other", 1), ("new", 2)):
        assert simulate(*SMALL, "--seed", seed, "-o", tmp_path / name).code == 0
        assert simulate(*QUICK, "--seed", seed, "-o", tmp_path / f"{name}.mcap").code == 0
    one, other, new = (tmp_path / name for name in ("one", "other", "new"))
    assert images(one) == images(other)
    assert not set(images(one).values()) & set(images(new).values())
    documents_of = [(folder / "recording.yaml").read_bytes() for folder in (one, other, new)]
    assert documents_of[0] == documents_of[1] != documents_of[2]
    bags = [folder.with_suffix(".mcap").read_bytes() for folder in (one, other, new)]
    assert bags[0] == bags[1] != bags[2]


def test_truth_is_what_the_recording_was_made_from(simulate, tmp_path):
    words = (*SMALL, "--seed", 4, "--robot-rotation", "3mrad", "--robot-translation", "0.7mm")
    truth_file = tmp_path / "made" / "truth.json"
    done = simulate(*words, "--fault", "scaled:1.1", "-o", truth_file.parent, "--truth", truth_file)
    assert done.code == 0, done.err
    truth = json.loads(truth_file.read_text(encoding="utf-8"))
    assert truth["noise"] == pytest.approx(
        {"robot_rotation_mrad": 3.0, "robot_translation_mm": 0.7, "image_grey_levels": 2.0}
    )
    assert (truth["seed"], truth["faults"]) == (4, ["scaled:1.1"])
    told = loaded(truth_file.parent / "recording.yaml")["stations"]
    X, Z = matrix(truth["gripper_T_camera"]), matrix(truth["base_T_target"])
    for station, entry in zip(truth["stations"], told, strict=True):
        robot, seen = matrix(station["base_T_gripper"]), matrix(station["camera_T_target"])
        assert robot @ X @ seen == pytest.approx(Z, abs=1e-12)
        noise = se3.difference(matrix(entry["base_T_gripper"]), robot)
        assert 1e-4 < np.linalg.norm(noise[3:]) < 12e-3
        assert 2e-5 < np.linalg.norm(noise[:3]) < 3e-3


def test_provenance_tells_that_it_was_made_and_how(simulate, tmp_path):
    words = (*QUICK, "--seed", 5, "--fault", "dropped:1", "--fault", "bowed:0.1mm")
    assert simulate(*words[: len(SMALL)], *words[-6:], "-o", tmp_path / "made").code == 0
    assert simulate(*words, "-o", tmp_path / "made.mcap").code == 0
    (step,) = loaded(tmp_path / "made" / "recording.yaml")["provenance"]
    assert step["command"] == "simulate recording"
    assert step["options"]["fault"] == "dropped:1 bowed:0.1mm"
    assert step["options"]["seed"] == 5
    with (tmp_path / "made.mcap").open("rb") as file:
        (note,) = make_reader(file).iter_metadata()
    assert note.metadata["command"] == "simulate recording"
    assert note.metadata["fault"] == "dropped:1 bowed:0.1mm"


def test_a_plan_and_its_calibration_send_robot_and_camera_where_they_say(
    simulate, handeye, tmp_path
):
    first, plan = tmp_path / "first", tmp_path / "plan.yaml"
    assert simulate(*HALF, "--seed", 1, "--stations", 5, "-o", first).code == 0
    calibration = tmp_path / "calibration.yaml"
    assert handeye("solve", first / "recording.yaml", "-o", calibration).code == 0
    lines = ("--stations", 4, "--verification", 2, "--distance", "90mm", "--target")
    done = handeye(
        "plan", *lines, "disc-grid:6x6:5mm:4mm", "--calibration", calibration, "-o", plan
    )
    assert done.code == 0, done.err
    words = ("--seed", 2, "--plan", plan, "--calibration", calibration, "--robot-rotation", "0mrad")
    made = tmp_path / "made"
    done = simulate(*words, "--robot-translation", "0mm", "-o", made, "--camera", calibration)
    assert done.code == 0, done.err
    planned, told = loaded(plan)["stations"], loaded(made / "recording.yaml")
    assert len(told["stations"]) == 6
    for station, entry in zip(planned, told["stations"], strict=True):
        assert entry["name"] == station["name"]
        assert matrix(entry["base_T_gripper"]) == pytest.approx(
            matrix(station["base_T_gripper"]), abs=1e-9
        )
    assert told["camera"]["fx"] == pytest.approx(275.0, rel=0.02)
    assert "covariance" not in told["camera"]
    files = [entry["file"] for entry in told["provenance"][0]["inputs"]]
    assert files == [str(plan), str(calibration), str(calibration)]


def test_a_camera_on_the_base_watches_a_target_on_the_gripper(simulate, handeye, tmp_path):
    words = ("--setup", "eye-to-hand", "--seed", 6, "--target", "chessboard:7x5:8mm")
    truth_file = tmp_path / "truth.yaml"
    done = simulate(*words, *HALF, "--stations", 6, "-o", tmp_path / "made", "--truth", truth_file)
    assert done.code == 0, done.err
    done = handeye("solve", tmp_path / "made" / "recording.yaml", "-o", "-", "--json")
    answer, truth = json.loads(done.out), loaded(truth_file)
    apart = se3.difference(matrix(answer["base_T_camera"]), matrix(truth["base_T_camera"]))
    assert 1e3 * np.linalg.norm(apart[:3]) < answer["predicted_error"]["translation_95_mm"]


def test_a_lens_is_drawn_with_its_distortion(simulate, tmp_path):
    plain, bent = tmp_path / "plain", tmp_path / "bent"
    assert simulate(*SMALL, "--seed", 1, "-o", plain).code == 0
    lens = ("--distortion", "-0.2,0.05,0.001,0,0")
    assert simulate(*SMALL, "--seed", 1, *lens, "-o", bent).code == 0
    assert loaded(bent / "recording.yaml")["camera"]["distortion"] == [-0.2, 0.05, 0.001, 0, 0]
    assert images(plain)["00.png"] != images(bent)["00.png"]


def test_a_dropped_picture_is_no_file_and_no_message(simulate, handeye, tmp_path):
    made = tmp_path / "made"
    assert simulate(*SMALL, "--seed", 1, "-o", made).code == 0
    # the picture of an earlier run must not stand in for the one that is dropped
    assert simulate(*SMALL, "--seed", 1, "--fault", "dropped:2", "-o", made, "--force").code == 0
    assert sorted(images(made)) == ["00.png", "01.png", "03.png"]
    assert loaded(made / "recording.yaml")["stations"][2]["image"] == "images/02.png"
    bag = tmp_path / "made.mcap"
    assert simulate(*QUICK, "--seed", 1, "--fault", "dropped:2", "-o", bag).code == 0
    read = as_read(bag)
    assert len(read.stations) == 3
    assert "1 of 4 pauses have no image" in [finding.message for finding in read.findings]


def test_late_images_are_put_right_by_the_flag_of_the_reader(simulate, tmp_path):
    paths = [tmp_path / name for name in ("good.mcap", "late.mcap")]
    words = (*QUICK, "--seed", 1, "--image-noise", 0)
    assert simulate(*words, "-o", paths[0]).code == 0
    assert simulate(*words, "--fault", "time-offset:500ms", "-o", paths[1]).code == 0
    good, late, corrected = (
        [station.image.load() for station in read.stations]
        for read in (as_read(paths[0]), as_read(paths[1]), as_read(paths[1], -500_000_000))
    )
    assert all(map(np.array_equal, good, corrected))
    assert not any(map(np.array_equal, good[1:], late[1:]))


def test_raw_pictures_are_those_of_the_compressed_ones(simulate, tmp_path):
    for name, flags in (("png", ()), ("raw", ("--raw",))):
        assert simulate(*QUICK, "--seed", 1, *flags, "-o", tmp_path / f"{name}.mcap").code == 0
    png, raw = (as_read(tmp_path / f"{name}.mcap") for name in ("png", "raw"))
    for one, other in zip(png.stations, raw.stations, strict=True):
        assert np.array_equal(one.image.load(), other.image.load())
    assert "compressed" in png.stations[0].image.label
    assert "compressed" not in raw.stations[0].image.label


def test_a_target_out_of_the_picture_is_told(simulate, tmp_path):
    words = (*SMALL, "--seed", 1, "--fault", "moved-plate:2:100mm")
    done = simulate(*words, "-o", tmp_path / "made")
    assert done.code == 0
    assert "not wholly in the picture at 2 of 4 stations: 02, 03 [target-out-of-view]" in done.err


def test_a_person_is_told_how_to_go_on(simulate, tmp_path):
    bag = tmp_path / "made.mcap"
    done = simulate(*QUICK, "--seed", 1, "-o", bag, terminal=True)
    assert f"handeye solve {bag} --setup eye-in-hand --target disc-grid:6x6:5mm:4mm" in done.out
    done = simulate(*SMALL, "--seed", 1, "-o", tmp_path / "made", terminal=True)
    assert f"handeye solve {tmp_path / 'made'}/recording.yaml" in done.out
    done = simulate(*SMALL, "--seed", 1, "-o", tmp_path / "cell 4; $x/", terminal=True)
    assert f"handeye solve '{tmp_path / 'cell 4; $x'}/recording.yaml'\n" in done.out
    assert simulate(*SMALL, "-q", "-o", tmp_path / "quiet", terminal=True).out == ""


def test_of_several_flags_without_effect_the_first_is_told(simulate, tmp_path):
    words = ["--height", 90, "--focal-px", 100, "--width", 90, "--camera", "a.yaml"]
    for _ in range(3):
        done = simulate(*words, "-o", tmp_path / "made")
        assert (done.code, done.out) == (2, "")
        assert done.err.startswith("error: --width has no effect beside --camera")


def test_what_is_there_stays_without_force(simulate, tmp_path):
    for name, words in (("made", SMALL), ("made.mcap", QUICK)):
        path = tmp_path / name
        assert simulate(*words, "--seed", 1, "-o", path).code == 0
        file = path if path.suffix else path / "recording.yaml"
        before = file.read_bytes()
        done = simulate(*words, "--seed", 2, "-o", path)
        assert done.code == 2
        assert "exists already" in done.err
        assert "--force" in done.err
        assert file.read_bytes() == before
        assert simulate(*words, "--seed", 2, "-o", path, "--force").code == 0
        assert file.read_bytes() != before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["made", "made.mcap"]


@pytest.mark.parametrize(
    ("words", "code", "parts"),
    [
        (("--fault", "swaped:1,2"), 2, ["'swaped'", "did you mean swapped:STATION,STATION"]),
        (("--fault", "dropped:4"), 2, ["00, 01, 02, 03", "'4'"]),
        (("--fault", "time-offset:40ms"), 2, ["--fault time-offset acts on an MCAP", ".mcap"]),
        (("--fault", "bowed:9mm"), 2, ["--fault bowed", "at 10 deg or more", "a smaller bow"]),
        (("--gradient", "1,-1"), 2, ["--gradient", "less than 2, found '1,-1'"]),
        (("--gradient", "0.1"), 2, ["found '0.1'", "such as 0.12,-0.08"]),
        (("--rate", "3"), 2, ["--rate acts on an MCAP recording only"]),
        (("--raw",), 2, ["--raw acts on an MCAP recording only"]),
        (("--target", "chesboard:9x6:5mm"), 2, ["'chesboard'", "did you mean 'chessboard'"]),
        (("--tilt", "85deg"), 2, ["found 85 deg"]),
        (("--distance", "20"), 2, ["found '20'"]),
        (("--robot-rotation", "=-1mrad"), 2, ["'=-1mrad'"]),
        (("--robot-translation", "-1mm"), 2, ["--robot-translation", "found '-1mm'"]),
        (("--distortion", "0.1,0.2"), 2, ["--distortion", "found '0.1,0.2'"]),
        (("--distortion", "0.1,a,0,0"), 2, ["found '0.1,a,0,0'"]),
        (("--plan", "nowhere.yaml"), 3, ["nowhere.yaml", "No such file"]),
        (("--camera", "nowhere.yaml"), 2, ["has no effect beside --camera"]),
        (("--calibration", "nowhere.yaml"), 3, ["nowhere.yaml", "No such file"]),
    ],
)
def test_bad_words_are_refused_before_anything_is_written(refused, tmp_path, words, code, parts):
    refused(*words, "-o", tmp_path / "made", code=code, parts=parts)


def test_an_mcap_in_no_folder_and_a_folder_in_a_file_are_refused(refused, tmp_path):
    refused("-o", tmp_path / "none" / "made.mcap", code=3, parts=["existing folder", "none"])
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    refused("-o", file / "made", code=3, parts=["the folder cannot be made"])
    refused("--pause", "0s", "-o", tmp_path / "made.mcap", code=2, parts=["found 0 s"])


def test_help_has_an_example_of_every_fault():
    _, flag = flags_of(Scenery)["fault"]
    examples = [row.example for row in FAULTS.values()]
    assert [example for example in examples if example not in flag.settings["help"]] == []


def test_documents_of_other_kinds_are_refused(simulate, tmp_path):
    made = tmp_path / "made"
    assert simulate(*SMALL, "--seed", 1, "-o", made).code == 0
    document = made / "recording.yaml"
    for flag in ("--plan", "--calibration"):
        done = simulate("--seed", 1, flag, document, "-o", tmp_path / "next")
        assert done.code == 3
        assert f"expected a {flag[2:]} document, found a recording document" in done.err
    blind = tmp_path / "blind.yaml"
    data = loaded(document)
    del data["camera"]
    blind.write_text(json.dumps(data), encoding="utf-8")
    done = simulate("--seed", 1, "--camera", blind, "-o", tmp_path / "next")
    assert done.code == 3
    assert "blind.yaml: expected a document with a camera, found a recording document" in done.err
    assert not (tmp_path / "next").exists()
