"""`handeye extract --draw`: a picture for each station, in one folder, whatever their names are."""

import json
import shutil
from pathlib import Path

import cv2
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from handeye_cli.cli.pictures import file_names

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "paper-plate"


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def recording(tmp_path):
    """Write a recording of the sample's first stations with other names; return its path."""

    def make(*names, spoil=None):
        document = yaml.safe_load((SAMPLE / "recording.yaml").read_text(encoding="utf-8"))
        document["stations"] = document["stations"][: len(names)]
        (tmp_path / "images").mkdir()
        for name, station in zip(names, document["stations"], strict=True):
            station["name"] = name
            shutil.copy(SAMPLE / station["image"], tmp_path / station["image"])
        if spoil is not None:
            (tmp_path / document["stations"][spoil]["image"]).write_bytes(b"nothing to see")
        path = tmp_path / "recording.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    return make


def test_every_station_has_its_picture_and_the_document_does_not_change(
    handeye, recording, tmp_path
):
    path, folder = recording("a", "b", "c"), tmp_path / "new" / "pictures"
    done = handeye("extract", path, "--draw", folder, "--workers", 2)
    assert done.code == 0, done.err
    assert listed(folder) == ["a.png", "b.png", "c.png"]
    assert done.out == handeye("extract", path).out
    plain = cv2.imread(str(tmp_path / "images" / "00.png"))
    drawn = cv2.imread(str(folder / "a.png"))
    band = drawn.shape[0] - 2 * plain.shape[0]
    assert drawn.shape[1] == 2 * plain.shape[1]
    assert 20 < band < 100
    # colour is drawn on the image, and most of the image stays as it is
    changed = (drawn[band::2, ::2] != plain).any(axis=2)
    assert 0.005 < changed.mean() < 0.1


def test_an_image_that_cannot_be_read_is_said_and_has_no_picture(handeye, recording, tmp_path):
    path = recording("a", "b\x1b[2J", "c", spoil=1)
    done = handeye("extract", path, "--draw", tmp_path / "out", "-o", tmp_path / "f.yaml")
    assert done.code == 0
    assert listed(tmp_path / "out") == ["a.png", "c.png"]
    notes = [line for line in done.err.splitlines() if line.startswith("note: ")]
    assert len(notes) == 1
    assert notes[0].startswith("note: no picture of station b\N{REPLACEMENT CHARACTER}[2J: images/")
    assert "14 bytes that cannot be decoded" in notes[0]


def test_a_picture_that_exists_is_kept_and_said_before_the_work(handeye, recording, tmp_path):
    path, folder = recording("a", "b", "c"), tmp_path / "out"
    folder.mkdir()
    (folder / "b.png").write_text("mine")
    done = handeye("extract", path, "--draw", folder, "-o", tmp_path / "f.yaml")
    assert done.code == 2
    assert "b.png: the file exists already" in done.err
    assert "hint: replace it with --force" in done.err
    assert listed(folder) == ["b.png"]
    assert not (tmp_path / "f.yaml").exists()
    assert handeye("extract", path, "--draw", folder, "--force").code == 0
    assert cv2.imread(str(folder / "b.png")) is not None


def test_what_is_no_folder_is_refused(handeye, recording, tmp_path):
    path = recording("a", "b", "c")
    done = handeye("extract", path, "--draw", path)
    assert (done.code, done.out) == (2, "")
    assert "expected a folder, found a file" in done.err
    done = handeye("extract", path, "--draw", path / "below")
    assert (done.code, done.out) == (3, "")
    assert "the folder cannot be made: Not a directory" in done.err
    done = handeye("extract", path, "--draw", tmp_path / ("x" * 300))
    assert (done.code, done.out) == (3, "")
    assert "the folder cannot be made: File name too long" in done.err


def test_names_of_stations_do_not_lead_out_of_the_folder(handeye, recording, tmp_path):
    path = recording("../../out", "/etc/passwd", "..")
    done = handeye("extract", path, "--draw", tmp_path / "out", "-o", tmp_path / "f.yaml")
    assert done.code == 0, done.err
    assert listed(tmp_path / "out") == ["_.._out.png", "_.png", "_etc_passwd.png"]
    assert listed(tmp_path) == ["f.yaml", "images", "out", "recording.json"]


def test_only_extract_draws(handeye, recording, tmp_path):
    done = handeye("solve", recording("a", "b", "c"), "--draw", tmp_path / "out")
    assert done.code == 2
    assert "found '--draw'" in done.err


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["00", "01", "left top", "a.b-c_d+e=f@g"], ["00", "01", "left top", "a.b-c_d+e=f@g"]),
        (["a/b", "a:b", "a_b"], ["a_b-2", "a_b-3", "a_b"]),
        (["A", "a", "a-2"], ["A", "a-2", "a-2-2"]),
        (["", "..", "-o", ".hidden", "a. "], ["_", "_-2", "o", "hidden", "a"]),
        (["CON", "nul.x", "com1", "comx"], ["_CON", "_nul.x", "_com1", "comx"]),
        (["\N{CJK UNIFIED IDEOGRAPH-7B2C}1", "e\u0301"], ["\u7b2c1", "\u00e9"]),
        (["x" * 300, "x" * 301], ["x" * 50, "x" * 50 + "-2"]),
        (["a\0b", "a\nb", "\ud800"], ["a_b", "a_b-2", "_"]),
    ],
)
def test_names_of_files(names, expected):
    assert file_names(names) == expected


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.lists(st.text(max_size=60) | st.text("aA_-2./", max_size=4), unique=True, max_size=12))
def test_any_names_become_different_names_of_files_in_the_folder(names):
    found = file_names(names)
    assert len({name.casefold() for name in found}) == len(names)
    for name in found:
        assert name
        assert not set(name) & set('/\\:*?"<>|\0\n')
        assert name[0] not in ".-"
        assert len(name.encode()) <= 220
