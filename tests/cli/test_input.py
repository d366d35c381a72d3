"""Input that cannot be used: exit 3, one message, nothing written."""

import pytest


def refused(done, *words):
    """Check that a command gave one error with these words and nothing else."""
    assert done.code == 3
    assert done.out == ""
    assert done.err.startswith("error: ")
    assert done.err.count("error:") == 1
    assert len(done.err.splitlines()) <= 2
    for word in words:
        assert word in done.err


def test_a_missing_file(handeye, tmp_path):
    output = tmp_path / "out.yaml"
    refused(handeye("solve", tmp_path / "none.yaml", "-o", output), "none.yaml", "No such file")
    assert not output.exists()


@pytest.mark.parametrize("command", ["extract", "extrinsics", "solve", "verify"])
def test_a_folder(handeye, tmp_path, command):
    refused(handeye(command, tmp_path), str(tmp_path), "expected MCAP files in a folder")


def test_a_missing_recording(handeye, tmp_path):
    refused(handeye("solve", tmp_path / "none.mcap", "--setup", "eye-in-hand"), "none.mcap")


@pytest.mark.parametrize(
    "content", [b"", b"\x00\xff\x80", b"a: [1", b"- 1", b"schema: handeye/stations/9\n"]
)
def test_content_that_is_no_document(handeye, tmp_path, content):
    path = tmp_path / "odd.yaml"
    path.write_bytes(content)
    refused(handeye("solve", path), "odd.yaml")


def test_content_that_is_no_document_on_stdin(handeye):
    refused(handeye("solve", "-", stdin=b"a: [1"), "standard input")


def test_a_mistyped_key(handeye, stations_file):
    stations_file.write_text(stations_file.read_text().replace('"setup"', '"setpu"'))
    refused(handeye("solve", stations_file), "setpu", "setup", "hint: ")


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("extract", "expected a recording document, found a calibration document"),
        ("extrinsics", "expected a recording or features document, found a calibration document"),
        (
            "solve",
            "expected a recording, features or stations document, found a calibration document",
        ),
        (
            "verify",
            "expected a recording, features or stations document, found a calibration document",
        ),
    ],
)
def test_a_document_of_a_later_stage(handeye, calibration_file, tmp_path, command, expected):
    output = tmp_path / "out.yaml"
    refused(handeye(command, calibration_file, "-o", output), expected, "hint: ")
    assert not output.exists()


def test_a_document_where_pictures_are_needed(handeye, stations_file):
    refused(handeye("extract", stations_file), "expected a recording document, found a stations")


def test_a_calibration_flag_with_another_document(handeye, stations_file):
    done = handeye("verify", stations_file, "--calibration", stations_file)
    refused(done, "expected a calibration document, found a stations document")


def test_an_output_folder_that_does_not_exist(handeye, stations_file, tmp_path):
    done = handeye("solve", stations_file, "-o", tmp_path / "none" / "out.yaml")
    refused(done, "expected an existing folder", str(tmp_path / "none"))
