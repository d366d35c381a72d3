"""`handeye report`: from a recording or documents to one page."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from cli.scene import stations_document
from line.recordings import SAMPLE
from recording.bags import Robot, in_order, write

from handeye_cli.cli import digests
from handeye_cli.cli.camera_options import CameraFile
from handeye_cli.cli.options import Mcap
from handeye_cli.cli.report_inputs import open_library
from handeye_cli.cli.report_options import Sources
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.recording import survey
from handeye_cli.render.page.drawing import Pen

RECORDING = SAMPLE / "recording.yaml"
COUNT = 8
BOARD = "chessboard:9x6:2mm"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """A copy of the sample recording with some of its stations."""
    folder = tmp_path_factory.mktemp("sample") / "plate"
    shutil.copytree(RECORDING.parent, folder)
    path = folder / "recording.yaml"
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["stations"] = document["stations"][:COUNT]
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out the figures, which take long and have tests of their own."""
    monkeypatch.setattr(Pen, "draw", lambda *_: "<svg></svg>")


def test_a_recording_gives_everything(handeye, here, sample):
    done = handeye("report", sample, "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["page"] == "report.html"
    (case,) = told["cases"]
    assert (case["name"], case["light"], case["verified"]) == (str(sample), "green", True)
    assert "as predicted" in case["reasons"][-1]
    page = Path("report.html").read_text(encoding="utf-8")
    for section in ("verdict", "layout", "answer", "verification", "residuals", "images",
                    "stations", "inspection", "provenance"):  # fmt: skip
        assert f'<section class="{section}">' in page
    assert page.count("data:image/jpeg") == COUNT
    assert len(page) < 3_000_000
    assert f"{COUNT} of {COUNT}" in page


@pytest.mark.usefixtures("undrawn")
def test_documents_of_one_recording_come_together_with_their_images(handeye, here, sample):
    for words in (
        ["extract", sample, "-o", "features.yaml"],
        ["extrinsics", "features.yaml", "-o", "stations.yaml"],
        ["solve", "stations.yaml", "-o", "calibration.yaml"],
        ["verify", "stations.yaml", "--stations", "3,4", "-o", "verification.yaml"],
    ):
        assert handeye(*words).code == 0
    files = ["calibration.yaml", "verification.yaml", "features.yaml"]
    assert handeye("report", *files, "-o", "page.html").code == 0
    page = Path("page.html").read_text(encoding="utf-8")
    assert page.count("<article>") == 1
    assert page.count("data:image/jpeg") == COUNT
    assert "Held-out rotation error" in page

    recording = sample.rename(sample.with_name("elsewhere.yaml"))
    assert handeye("report", *files, "-o", "moved.html").code == 0
    recording.rename(sample)
    moved = Path("moved.html").read_text(encoding="utf-8")
    assert "recording.yaml is no longer where it was" in moved
    assert "data:image/jpeg" not in moved
    assert '<section class="residuals">' in moved


def test_a_recording_that_was_changed_is_not_taken_for_the_one_there_was(handeye, here, sample):
    recording = here / "recording.yaml"
    shutil.copytree(sample.parent, here, dirs_exist_ok=True)
    assert handeye("extract", recording, "-o", "features.yaml").code == 0
    recording.write_text(recording.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    library = open_library(Sources("features.yaml"), Mcap(), CameraFile())
    assert [each.name for each in library.reads] == ["features.yaml"]
    provenance = library.reads[0].record.provenance
    assert f"{recording} has changed since" in library.unreached(provenance)


def test_files_are_reached_from_the_folder_of_their_document(handeye, here, stations_file):
    assert handeye("solve", stations_file.name, "-o", "a.yaml").code == 0
    (here / "elsewhere").mkdir()
    os.chdir("elsewhere")
    library = open_library(Sources("../a.yaml"), Mcap(), CameraFile())
    found = [Path(each.name).resolve() for each in library.reads]
    assert found == [here / "a.yaml", stations_file]
    assert [each.asked for each in library.reads] == [True, False]


@pytest.mark.usefixtures("undrawn")
def test_poses_alone_are_calibrated_and_verified_into_a_pipe(handeye, here, stations_file):
    done = handeye("report", stations_file, "-o", "-")
    assert done.code == 0, done.err
    assert done.out.startswith("<!DOCTYPE html>")
    assert "Each station is predicted by a calibration on all others" in done.out
    assert '<section class="images">' not in done.out
    assert "written" not in done.err
    assert list(here.glob("*.html")) == []


@pytest.mark.usefixtures("undrawn")
def test_two_answers_stand_side_by_side(handeye, here, stations_file):
    handeye("solve", stations_file, "-o", "a.yaml")
    handeye("solve", stations_file, "--method", "tsai-lenz", "-o", "b.yaml")
    assert handeye("report", "a.yaml", "b.yaml").code == 0
    page = Path("report.html").read_text(encoding="utf-8")
    assert page.count("<article>") == 2
    assert "Side by side" in page
    assert "predicted only, not verified" in page


@pytest.mark.usefixtures("undrawn")
def test_a_page_that_exists_is_replaced_by_force_only(handeye, here):
    assert handeye("plan", "--stations", "5", "--distance", "170mm", "-o", "plan.yaml").code == 0
    Path("report.html").write_text("mine", encoding="utf-8")
    done = handeye("report", "plan.yaml")
    assert done.code == 2
    assert "report.html" in done.err
    assert Path("report.html").read_text(encoding="utf-8") == "mine"
    assert handeye("report", "plan.yaml", "--force").code == 0
    assert Path("report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.usefixtures("undrawn")
def test_a_limit_that_is_missed_is_red_and_exit_6(handeye, here, stations_file):
    handeye("solve", stations_file, "-o", "a.yaml")
    limits = ["--max-rotation-mrad", "0.001", "--max-translation-mm", "0.002"]
    done = handeye("report", "a.yaml", *limits)
    assert done.code == 6
    page = Path("report.html").read_text(encoding="utf-8")
    for words in ("up to 0.001 mrad", "up to 0.002 mm"):
        assert words in done.err
        assert words in page
    assert "written to report.html: red" in done.err


@pytest.mark.usefixtures("undrawn")
def test_data_without_an_answer_make_a_red_page_and_exit_4(handeye, here):
    document = stations_document(6)
    for station in document["stations"]:
        pose = station["base_T_gripper"]
        pose["translation"] = [1000.0 * each for each in pose["translation"]]
    Path("wrong.json").write_text(json.dumps(document), encoding="utf-8")
    done = handeye("report", "wrong.json")
    assert done.code == 4
    page = Path("report.html").read_text(encoding="utf-8")
    assert "Do not rely on this" in page
    assert '<span class="badge error">error</span>' in page


BATCH = """\
schema: handeye/batch/1
exit_code: 4
rows:
  - {name: cell/1.mcap, status: ok, exit_code: 0, stations: 9, used: 9,
     seen_error: {rotation_mrad: 0.5, translation_mm: 0.75}}
  - {name: cell/2.mcap, status: failed, exit_code: 4, message: all axes are parallel}
"""


@pytest.mark.usefixtures("undrawn")
def test_a_simulation_a_plan_and_a_batch_are_shown(handeye, here):
    Path("batch.yaml").write_text(BATCH, encoding="utf-8")
    plan = ["plan", "--stations", "5", "--distance", "170mm", "-o", "plan.yaml"]
    assert handeye(*plan).code == 0
    assert handeye("simulate", "--figure", "12", "--trials", "3", "-o", "figure.yaml").code == 0
    done = handeye("report", "plan.yaml", "figure.yaml", "batch.yaml", "--json")
    assert done.code == 0
    lights = [(each["name"], each["light"]) for each in json.loads(done.out)["cases"]]
    assert lights == [("plan.yaml", None), ("figure.yaml", None), ("batch.yaml", "red")]
    page = Path("report.html").read_text(encoding="utf-8")
    assert '<section class="plan">' in page
    assert "data:image/png" in page
    for words in ("1 of 2: cell/2.mcap", "all axes are parallel", ">0.750</td>"):
        assert words in page


@pytest.mark.usefixtures("undrawn")
def test_a_robots_recording_shows_its_topics_and_the_time_of_its_images(handeye, here):
    recording = SAMPLE.parent / "paper-plate.mcap"
    flags = ["--setup", "eye-in-hand", "--target", "disc-grid:6x6:5mm:4mm", "--no-images"]
    done = handeye("report", recording, *flags)
    assert done.code == 0, done.err
    assert "written to report.html: green" in done.err
    page = Path("report.html").read_text(encoding="utf-8")
    for words in ("sensor_msgs/msg/CompressedImage (cdr)", "12 pauses of the robot",
                  "world -&gt; base_link -&gt; tool0", "Time between images and poses",
                  "images run ahead of the robot&#x27;s poses by"):  # fmt: skip
        assert words in page


@pytest.fixture
def passes(monkeypatch):
    """The ways through recordings, and the files that are hashed."""
    taken, hashed = [], []
    take, digesting = survey.take, digests.digesting
    monkeypatch.setattr(survey, "take", lambda *words: taken.append(words) or take(*words))
    monkeypatch.setattr(
        digests, "digesting", lambda files: hashed.append(files) or digesting(files)
    )
    return lambda: (len(taken), len(hashed))


def test_a_robots_recording_is_gone_through_and_hashed_once(here, passes):
    path = write(here / "a.mcap", Robot(stations=2).messages())
    library = open_library(
        Sources(path, setup=Setup.EYE_IN_HAND, target=BOARD), Mcap(), CameraFile()
    )
    assert passes() == (1, 1)
    (read,) = library.reads
    assert len(read.record.stations) == 2
    assert read.summary.used.image_topic == "/camera/image_raw"
    assert read.sha256 == hashlib.sha256((here / "a.mcap").read_bytes()).hexdigest()


@pytest.mark.parametrize(
    ("flags", "message"),
    [({}, "where the camera is fixed"), ({"setup": Setup.EYE_IN_HAND}, "one image topic, found 2")],
)
def test_what_is_in_the_way_of_reading_a_recording_is_an_error(here, flags, message):
    robot = Robot(stations=2)
    other = replace(robot, image_topic="/right/image_raw")
    path = write(here / "a.mcap", in_order(robot.messages(), other.images()))
    with pytest.raises(InputError, match=message):
        open_library(Sources(path, target=BOARD, **flags), Mcap(), CameraFile())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device here that is always full")
@pytest.mark.parametrize("flags", ["-o -", "--json"])
def test_a_page_that_cannot_be_written_is_an_error(shell, here, flags):
    plan = "handeye plan --stations 5 --distance 170mm -o plan.yaml"
    done = shell(f"{plan} && handeye report plan.yaml {flags} > /dev/full")
    assert done.code == 3
    assert done.err.count("\n") <= 2
    assert "standard output: cannot be written: No space left on device" in done.err


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["none.yaml"], 3, "none.yaml"),
        (["none.yaml", "--method", "tsai-lens"], 2, "did you mean tsai-lenz?"),
        (["none.yaml", "-o", "missing/report.html"], 3, "missing"),
        ([], 2, "INPUT"),
        (["none.yaml", "--json", "-o", "-"], 2, "the page or --json on stdout"),
        ([RECORDING.with_name("truth.yaml")], 3, "found a truth document"),
    ],
)
def test_wrong_words(handeye, here, words, code, message):
    done = handeye("report", *words)
    assert done.code == code
    assert message in done.err


def test_flags_about_a_robots_recording_act_on_it_wherever_it_stands(handeye, here, stations_file):
    flags = ["--image-topic", "/camera"]
    done = handeye("report", stations_file, "none.mcap", *flags)
    assert done.code == 3
    assert "none.mcap" in done.err
    assert handeye("report", stations_file, *flags).code == 2


def test_an_answer_cannot_be_given_other_intrinsics(handeye, here, stations_file):
    handeye("solve", stations_file, "-o", "a.yaml")
    done = handeye("report", "a.yaml", "--calibrate-intrinsics")
    assert done.code == 2
    assert "a.yaml" in done.err


def test_without_matplotlib_the_extra_is_named(handeye, here, stations_file, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = handeye("report", stations_file)
    assert done.code == 2
    assert "handeye-cli[plot]" in done.err
