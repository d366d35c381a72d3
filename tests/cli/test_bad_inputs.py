"""Input that nobody would write in good faith: bounded time and memory, and one clear error.

`tests/line` has the faults of documents and recordings key by key; here are files that try to
exhaust, to escape or to confuse, and the commands beside the line.
"""

from __future__ import annotations

import io
import json
import os
import resource
import struct
import subprocess
import sys
import zipfile
import zlib

import numpy as np
import pytest
from line.conftest import good, impatient, refused
from line.good_input import write
from line.recordings import SAMPLE
from recording import bags, surgery

__all__ = ["good", "impatient", "refused"]

EYE = ("--setup", "eye-in-hand")
PLATE = ("--target", "disc-grid:6x6:5mm:4mm")
NAMES = ("--parent", "tool0", "--child", "camera")
HEADER = "schema: handeye/stations/1\nsetup: eye-in-hand\n"
POSE = "{translation: [0, 0, 0], quaternion: [0, 0, 0, 1]}"
WHOLE = f"{HEADER}stations: [{{name: a, base_T_gripper: {POSE}, reason: fog}}]\n"


def bomb(first, link):
    """Return nine lines of which each stands for ten times as much as the one before."""
    lines = [f"a: &a {first}"]
    for before, name in zip("abcdefgh", "bcdefghij", strict=False):
        lines.append(f"{name}: &{name} {link(', '.join([f'*{before}'] * 10))}")
    return "\n".join(lines)


LISTS = bomb("[1, 1, 1]", lambda ten: f"[{ten}]")
MERGES = bomb("{k: 1}", lambda ten: f"{{<<: [{ten}]}}")
CSV = "time,x,y,z,qx,qy,qz,qw\n"


def png(width, height, *, depth=8):
    """Return a PNG that says a size, with the pixels of one row."""

    def chunk(kind, content):
        checksum = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", checksum)

    head = struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(100))
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def npz(shape, content=b""):
    """Return an NPZ file with an array of a shape, filled or not."""
    head = str({"descr": "<f8", "fortran_order": False, "shape": shape}).ljust(117) + "\n"
    holder = io.BytesIO()
    with zipfile.ZipFile(holder, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + content
        archive.writestr("R_target2cam.npy", array)
    return holder.getvalue()


TEXTS = {
    "alias-bomb": (HEADER + LISTS, ["line 8", "aliases for at most 100000 values"]),
    "merge-bomb": (HEADER + MERGES, ["aliases for at most 100000 values"]),
    "alias-of-itself": (HEADER + "stations: &a [*a]\n", ["*a stands for nothing before it"]),
    "alias-as-key": (HEADER + "a: &a b\n*a : 1\n", ["a text as key, found an alias"]),
    "tag-object": (HEADER + "name: !!python/object:os.x {}\n", ["python/object:os.x"]),
    "tag-float": (HEADER + "x: !!float 1\n", ["tag:yaml.org,2002:float"]),
    "deep-flow": ("[" * 100_000, ["column 61", "at most 60 levels"]),
    "deep-block": ("- " * 100_000, ["column 121", "at most 60 levels"]),
    "exponent-as-text": (HEADER + f"stations: [{{base_T_gripper: {POSE}, name: a, "
                         "reason: 1e-05}]\n", ["stations[0].reason", "found the number 1e-05"]),
    "no-is-text": (HEADER + "stations: [{name: a, found: no}]\n", ["stations[0]"]),
    "sexagesimal-is-text": (WHOLE.replace("eye-in-hand", "12:30"), ["setup", "found '12:30'"]),
    "quoted-number": (WHOLE + 'noise: {pixel: "0.1"}\n', ["noise.pixel", "found '0.1'"]),
    "number-of-5000-digits": (WHOLE + f"noise: {{pixel: {'9' * 5000}}}\n", ["noise.pixel"]),
    "exponent-beyond": (WHOLE + "noise: {pixel: 1e999}\n", ["noise.pixel", "found inf"]),
    "huge": (WHOLE + "noise: {pixel: 1e300}\n", ["noise.pixel", "1e+30", "found 1e+300"]),
    "not-a-number": (WHOLE + "noise: {pixel: .nan}\n", ["noise.pixel", "found nan"]),
    "duplicate-key": (HEADER + "setup: eye-to-hand\n", ["line 3", "'setup'", "line 2"]),
    "merge-key": (HEADER + "<<: {a: 1}\n", ["'<<'"]),
    "utf-16-without-mark": (HEADER.encode("utf-16-le"), ["line 1", "control char", "a zero byte"]),
    "utf-16-cut": (HEADER.encode("utf-16")[:-1], ["UTF-16 text, as its first bytes say"]),
    "nul": (HEADER + "stations: \0\n", ["a zero byte"]),
    "latin-1": (HEADER.encode() + b"name: \xe4\n", ["line 3", "the byte 0xe4"]),
    "gzip": (b"\x1f\x8b\x08" + bytes(20), ["the byte 0x8b"]),
    "long-key": (HEADER + f"? {'k' * 3000}\n: 1\n", ["unknown key"]),
}  # fmt: skip
"""A document's text; parts of the message of `solve`."""


def saved(path, content):
    """Write a text, bytes, or what a function makes when it is needed."""
    content = content() if callable(content) else content
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("row", TEXTS)
def test_a_text_that_is_no_document(refused, tmp_path, row):
    content, parts = TEXTS[row]
    refused(["solve", saved(tmp_path / "in.yaml", content)], 3, ["in.yaml", *parts])


NUMBERS = {
    "zero-quaternion": ("quaternion", [0, 0, 0, 0], ["found the norm 0"]),
    "tiny-quaternion": ("quaternion", [1e-200] * 4, ["found the norm 0"]),
    "huge-quaternion": ("quaternion", [1e29] * 4, ["found the norm 2e+29"]),
    "huge-translation": ("translation", [1e300, 0, 0], ["found 1e+300"]),
    "not-finite": ("translation", [0, float("inf"), 0], ["translation[1]", "found inf"]),
    "no-numbers": ("translation", [True, None, "0"], ["translation[0]"]),
    "list-of-lists": ("translation", [[0], [0], [0]], ["translation[0]"]),
    "many-numbers": ("translation", [0] * 100_000, ["found a list of 100000"]),
}
"""Key of a robot's pose, value; parts of the message."""


@pytest.mark.parametrize("row", NUMBERS)
def test_numbers_of_a_pose(refused, good, tmp_path, row):
    key, value, parts = NUMBERS[row]
    document = json.loads(json.dumps(good["stations"]))
    document["stations"][1]["base_T_gripper"][key] = value
    place = f"stations[1].base_T_gripper.{key}"
    refused(["solve", write(tmp_path / "in.yaml", document)], 3, [place, *parts])


PICTURES = {
    "text": (lambda file: file.write_text("hello"), "5 bytes that cannot be decoded"),
    "bomb": (lambda file: file.write_bytes(png(60_000, 60_000)), "found 60000 x 60000"),
    "bomb-deep": (lambda file: file.write_bytes(png(60_000, 60_000, depth=16)), "60000 x 60000"),
    "other-size": (lambda file: file.write_bytes(png(8, 8)), "found one of 8x8"),
    "fifo": (os.mkfifo, "found a device or pipe"),
    "folder": (lambda file: file.mkdir(), "found a folder"),
    "gone": (lambda file: None, "No such file"),
}
"""What stands in the place of the pictures; the reason."""


@pytest.mark.parametrize("row", PICTURES)
def test_pictures_that_are_none(refused, good, tmp_path, row):
    spoil, reason = PICTURES[row]
    document = json.loads(json.dumps(good["recording"]))
    del document["stations"][3:]
    (tmp_path / "images").mkdir()
    for station in document["stations"]:
        spoil(tmp_path / station["image"])
    file = write(tmp_path / "in.yaml", document)
    refused(["solve", file], 4, ["in.yaml", "none of 3", reason])


PATHS = {
    "up": ["../secret.png", "found '../secret.png'"],
    "up-inside": ["images/../../secret.png", "found 'images/../../secret.png'"],
    "absolute": ["/etc/passwd", "found '/etc/passwd'"],
    "device": ["/dev/zero", "found '/dev/zero'"],
    "link": ["link.png", "which is /dev/zero"],
    "linked-folder": ["etc/passwd", "which is /etc/passwd"],
}


@pytest.mark.parametrize("row", PATHS)
@pytest.mark.parametrize("command", ["extract", "inspect", "solve"])
def test_paths_that_leave_the_folder(refused, good, tmp_path, command, row):
    path, part = PATHS[row]
    (tmp_path / "link.png").symlink_to("/dev/zero")
    (tmp_path / "etc").symlink_to("/etc")
    document = json.loads(json.dumps(good["recording"]))
    document["stations"][1]["image"] = path
    file = write(tmp_path / "in.yaml", document)
    refused([command, file], 3, ["stations[1].image", part, "--allow-outside"])


MAGIC = surgery.MAGIC
MCAPS = {
    "cut-magic": (MAGIC[:5], ["expected an MCAP recording"]),
    "no-record": (MAGIC * 2, ["no channels at all"]),
    "length-beyond-the-file": (MAGIC + b"\x01" + b"\xff" * 8 + bytes(50), ["no channels"]),
    "zip": (b"PK\x03\x04" + bytes(60), ["starts with b'PK"]),
    "bomb-told": (surgery.ended(surgery.chunk_of(
        b"", "zstd", bytes(9), size=2**40)),
        ["at most 268435456"]),
    "bomb-untold": (lambda: surgery.ended(surgery.chunk_of(
        b"", "zstd", surgery.zstd_bomb(2**29, told=False), size=2**20)), ["cannot be read"]),
    "lz4-bomb": (lambda: surgery.ended(surgery.chunk_of(
        b"", "lz4", surgery.lz4_bomb(2**26), size=2**20)), ["unpacks to"]),
}  # fmt: skip
"""A file; parts of the message."""


@pytest.mark.parametrize("row", MCAPS)
def test_recordings_that_are_none(refused, tmp_path, row):
    content, parts = MCAPS[row]
    file = saved(tmp_path / "in.mcap", content)
    refused(["solve", file, *EYE, *PLATE], 3, ["in.mcap", *parts])


METADATA = {
    "deep": ("[" * 100_000, ["more than 60 levels"]),
    "merges": (MERGES, ["expected the metadata of a rosbag2 recording"]),
    "values": (f"[{'1, ' * 300_000}1]", ["more than 200000 values"]),
    "sexagesimal": (f"a: {'59:' * 40_000}1", ["expected the metadata"]),
    "fifo": (None, ["found a device or pipe"]),
}
"""A rosbag2 folder's metadata; parts of the message."""


@pytest.mark.parametrize("row", METADATA)
def test_metadata_of_a_bag_that_are_none(refused, tmp_path, row):
    content, parts = METADATA[row]
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "a.mcap").write_bytes(MAGIC * 2)
    if content is None:
        os.mkfifo(folder / "metadata.yaml")
    else:
        saved(folder / "metadata.yaml", content)
    refused(["inspect", folder], 3, ["metadata.yaml", *parts])


FOREIGN = {
    "deep.samples": ("[" * 5000, ["at most 60 levels"]),
    "bomb.samples": (LISTS, ["aliases for at most 100000 values"]),
    "empty.samples": ("", ["found nothing"]),
    "text.csv": ("hello\n", ["a known kind"]),
    "wide.csv": (CSV.encode("utf-16"), ["UTF-8 text", "0xff"]),
    "quote.csv": (CSV + '"' + "a" * 300_000, ["line 2", "expected 8 columns, found 1"]),
    "shape.npz": (npz((10**12,)), ["a known kind"]),
    "bomb.npz": (lambda: npz((5_000_000,), bytes(40_000_000)), ["a known kind"]),
    "ours.yaml": (HEADER, ["ours need no import"]),
}
"""Name and content of a file to import; parts of the message."""


@pytest.mark.parametrize("name", FOREIGN)
def test_data_of_other_tools_that_are_none(refused, tmp_path, name):
    content, parts = FOREIGN[name]
    refused(["import", saved(tmp_path / name, content), *EYE], 3, [name, *parts], write=())


def test_an_archive_says_how_much_it_would_unpack(refused, tmp_path):
    file = saved(tmp_path / "bomb.npz", npz((5_000_000,), bytes(40_000_000)))
    parts = ["bomb.npz", "expected at most 32 MB of arrays", "4e+07 B"]
    refused(["import", file, "--from", "opencv", *EYE], 3, parts, write=())


WORDS = {
    "export-name": (["export", "*calibration", "--to", "urdf", "--parent", "a b", "--child", "c"],
                    2, ["--parent", "found 'a b'"]),
    "export-kind": (["export", "*features", "--to", "kalibrr"], 2, ["kalibr"]),
    "export-to-folder": (["export", "*calibration", "--to", "kalibr", "-o", "*"], 2, ["a folder"]),
    "export-to-device": (["export", "*calibration", "--to", "kalibr", "-o", "/dev/full"], 2,
                         ["/dev/full", "a device"]),
    "export-from-device": (["export", "/dev/zero", "--to", "kalibr"], 3, ["/dev/zero", "found m"]),
    "report-device": (["report", "/dev/zero", "-o", "*/r.html"], 3, ["/dev/zero", "found more"]),
    "report-second": (["report", "*stations", "none.yaml", "-o", "*/r.html"], 3, ["none.yaml"]),
    "report-to-folder": (["report", "*stations", "-o", "*"], 2, ["a folder"]),
    "solve-two": (["solve", "*stations", "*features"], 2, ["found 2 inputs"]),
    "solve-mcap-none": (["solve", "*stations", "--mcap", "none/a.mcap"], 3, ["an existing folder"]),
    "solve-mcap-device": (["solve", "*stations", "--mcap", "/dev/null"], 2, ["a device or pipe"]),
    "solve-mcap-input": (["solve", "*stations", "--mcap", "*stations"], 2, ["which is the input"]),
    "solve-mcap-frames": (["solve", "*stations", "--mcap", "*/a.mcap", "--parent-frame", "a",
                           "--child-frame", "a"], 2, ["different names"]),
    "camera-device": (["solve", "*recording", "--camera", "/dev/zero"], 3, ["/dev/zero"]),
    "camera-huge": (["simulate", "recording", "--camera", "*camera", "-o", "*/made"], 3,
                    ["at most 10000 columns and rows, found 1000000000 x 2"]),
    "plan-huge": (["plan", "--stations", "5", "--distance", "1e300m"], 2, ["1e300m"]),
    "simulate-huge": (["simulate", "--trials", "100000000"], 2, ["found 100000000"]),
    "target-huge": (["extract", "*recording", "--target", "chessboard:999999999x3:1mm"], 2,
                    ["3 to 1000 as columns, found 999999999"]),
}  # fmt: skip
"""The words, `*kind` for a good document and `*` for the folder; exit code; parts."""


@pytest.mark.parametrize("row", WORDS)
def test_other_commands(refused, good, tmp_path, monkeypatch, row):
    words, code, parts = WORDS[row]
    monkeypatch.setattr("handeye_cli.documents.files.MAX_BYTES", 1_000_000)
    monkeypatch.setattr("handeye_cli.documents.text.MAX_BYTES", 1_000_000)
    camera = {"width": 10**9, "height": 2, "fx": 1, "fy": 1, "cx": 0, "cy": 0}
    for kind, data in {**good, "camera": {"camera": camera}}.items():
        write(tmp_path / f"{kind}.yaml", data)
    words = [resolved(word, tmp_path) for word in words]
    refused(words, code, parts, write=())


def resolved(word, folder):
    if word == "*" or word.startswith("*/"):
        return str(folder) + word[1:]
    return folder / f"{word[1:]}.yaml" if word.startswith("*") else word


PROVENANCES = {
    "fifo": ({"file": "pipe"}, {}),
    "long-name": ({"file": "x" * 300}, {}),
    "nul": ({"file": "a\0b"}, {}),
    "device": ({"file": "/dev/zero"}, {}),
    "unknown-choice": ({}, {"setup": "beside"}),
    "other-kinds": ({}, {"target": 5, "pose-units": ["m"], "quaternion-order": None}),
}
"""What a calibration says of the file it was made from, and of the flags."""


@pytest.mark.parametrize("row", PROVENANCES)
def test_a_report_does_not_believe_what_a_document_says_of_its_origin(
    handeye, impatient, good, tmp_path, row
):
    named, options = PROVENANCES[row]
    os.mkfifo(tmp_path / "pipe")
    write(tmp_path / "stations.yaml", good["stations"])
    step = {"command": "solve", "version": "1", "options": options}
    step["inputs"] = [{"file": "stations.yaml", "sha256": "0" * 64} | named]
    file = write(tmp_path / "in.yaml", good["calibration"] | {"provenance": [step]})
    done = handeye("report", file, "-o", tmp_path / "page.html")
    assert done.code == 0, done.err
    assert "written to" in done.err


def test_a_document_does_not_allow_itself_to_leave_its_folder(handeye, good, tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.png").write_bytes(png(640, 480))
    recording = json.loads(json.dumps(good["recording"]))
    del recording["stations"][3:]
    recording["stations"][0]["image"] = "../secret.png"
    (inside / "images").symlink_to(SAMPLE / "images")
    source = write(inside / "recording.yaml", recording)
    features = inside / "features.yaml"
    assert handeye("extract", source, "--allow-outside", "-o", features).code == 0
    done = handeye("report", features, "-o", inside / "a.html")
    assert done.code in (0, 4), done.err
    page = (inside / "a.html").read_text(encoding="utf-8")
    assert "cannot be read: expected an image inside the folder" in page


def test_intrinsics_of_no_camera_cost_the_pictures_and_not_the_time(
    handeye, impatient, good, tmp_path
):
    """A focal length of a thousandth would show a disc larger than the picture."""
    (tmp_path / "images").symlink_to(SAMPLE / "images")
    document = json.loads(json.dumps(good["recording"]))
    del document["stations"][1:]
    for factor in (1e-3, 1e6):
        fx = good["recording"]["camera"]["fx"] * factor
        file = write(tmp_path / "in.yaml", document | {"camera": document["camera"] | {"fx": fx}})
        done = handeye("extract", file, "--json", "--allow-outside")
        assert done.code == 0, done.err
        (station,) = json.loads(done.out)["stations"]
        assert not station["found"]
        assert "the plate cannot be seen where it is" in station["reason"]


def transforms_beyond_all_lengths():
    """A robot's recording in which some numbers are too large for a sum of their squares."""
    beyond = np.full(4, 1e200).tobytes()
    robot = bags.Robot(stations=3, rate=10.0, image_rate=2.0)
    return [
        (time, topic, kind, payload[: -len(beyond)] + beyond if topic == "/tf" else payload)
        for time, topic, kind, payload in robot.messages()
    ]


def test_quaternions_beyond_all_lengths_are_left_out(refused, tmp_path):
    path = tmp_path / "a.mcap"
    bags.write(path, transforms_beyond_all_lengths())
    refused(["solve", path, *EYE, *PLATE], 3, ["a.mcap"])


MEMORY = 1_500_000_000
"""Bytes of address space of a process; what is loaded alone takes a half of it."""
CHILDREN = {
    "alias-bomb": ("in.yaml", LISTS, ["solve"], 3),
    "deep": ("in.yaml", "[" * 1_000_000, ["solve"], 3),
    "image-bomb": ("in.yaml", None, ["solve"], 4),
    "zstd-bomb": ("in.mcap", MCAPS["bomb-untold"][0], ["solve", *EYE, *PLATE], 3),
    "npz-bomb": ("in.npz", lambda: npz((30_000_000,), bytes(240_000_000)), ["import", *EYE], 3),
    "device": ("/dev/zero", None, ["extract"], 3),
}
"""The input, its content; the words; the exit code."""


ALL_IN_TURN = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from handeye_cli.cli import app

def ended(words):
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        try:
            app.run(words)
        except SystemExit as end:
            return end.code, out.getvalue(), err.getvalue()

print(json.dumps([ended(words) for words in json.load(sys.stdin)]))
"""
"""One process for all of them: most of its time goes into loading what it needs."""


def spoilt(row, good, folder):
    """Write what a row is about, and return the words of its command."""
    name, content, (command, *flags), _ = CHILDREN[row]
    path = folder / name
    if content is not None:
        saved(path, content)
    elif row == "image-bomb":
        document = good["recording"] | {"stations": good["recording"]["stations"][:3]}
        (folder / "images").mkdir()
        for station in document["stations"]:
            (folder / station["image"]).write_bytes(png(14_000, 14_000))
        write(path, document)
    return [command, str(path), *flags]


@pytest.fixture(scope="module")
def children(good, tmp_path_factory):
    """Exit code, output and errors of each row in a process with little memory."""
    lines = [spoilt(row, good, tmp_path_factory.mktemp(row)) for row in CHILDREN]
    done = subprocess.run(
        [sys.executable, "-c", ALL_IN_TURN],
        input=json.dumps(lines),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    return dict(zip(CHILDREN, json.loads(done.stdout), strict=True))


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as on Linux")
@pytest.mark.xdist_group("little-memory")
@pytest.mark.parametrize("row", CHILDREN)
def test_memory_and_time_are_bounded(children, row):
    code, out, err = children[row]
    assert (code, out) == (CHILDREN[row][-1], ""), err
    assert sum(line.startswith("error: ") for line in err.splitlines()) == 1
    assert "Traceback" not in err
