"""Every command's report on a real terminal of 80 columns, as a process of its own."""

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from importlib import import_module
from pathlib import Path

import pytest
import yaml
from cli.scene import stations_document

from handeye_cli.cli.app import COMMANDS
from handeye_cli.cli.grouping import command_of, flags_of, groups_of

COLUMNS = 80
ESCAPE = re.compile(r"\x1b\[[0-9;]*m")
SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"

LINES = {
    "extrinsics features.yaml": "camera_T_target known for 4 of 5 stations",
    "solve stations.yaml --compare": "gripper_T_camera: the camera in the frame of the gripper",
    "verify stations.yaml": "Errors on stations that took no part",
    "inspect stations.yaml": "These data give an answer",
    "inspect exchanged.yaml": "These data give an answer, with reservations",
    "batch stations.yaml": "1 recording: 1 ok",
    "inspect robot.mcap": "This recording can be read",
    "plan --stations 8 --calibration calibration.yaml": "8 stations to visit",
    "simulate --trials 20": "20 simulated calibrations",
    "simulate --figure 13 --trials 5": "5 simulated calibrations in each point",
}
"""Command lines, and how the first line that they print begins: with the answer."""
WITHOUT_JSON = {"export", "simulate recording"}
"""Commands whose result is the file of another tool, or a folder of files."""


def _in_terminal(folder, words, **environment):
    """Run a command with a terminal as stdout and stderr; return exit code and text."""
    terminal, side = pty.openpty()
    fcntl.ioctl(side, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
    dropped = ("NO_COLOR", "FORCE_COLOR", "COLUMNS", "LINES", "CI", "GITHUB_ACTIONS")
    kept = {name: value for name, value in os.environ.items() if name not in dropped}
    process = subprocess.Popen(
        [sys.executable, "-m", "handeye_cli", *words],
        cwd=folder,
        env=kept | {"TERM": "xterm-256color", "OMP_NUM_THREADS": "1", **environment},
        stdin=subprocess.DEVNULL,
        stdout=side,
        stderr=side,
    )
    os.close(side)
    shown = b""
    while part := _read(terminal):
        shown += part
    os.close(terminal)
    return process.wait(), shown.decode().replace("\r\n", "\n")


def _read(terminal):
    try:
        return os.read(terminal, 4096)
    except OSError:  # how Linux says that the other side is closed
        return b""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a document of each stage, and a recording."""
    path = tmp_path_factory.mktemp("terminal")
    document = stations_document(12)
    exchanged = json.loads(json.dumps(document))
    poses = exchanged["stations"]
    poses[2]["base_T_gripper"], poses[7]["base_T_gripper"] = (
        poses[7]["base_T_gripper"],
        poses[2]["base_T_gripper"],
    )
    for name, data in {
        "stations": document,
        "exchanged": exchanged,
        "features": _features(),
    }.items():
        (path / f"{name}.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    (path / "robot.mcap").symlink_to(SAMPLE / "paper-plate.mcap")
    code, said = _in_terminal(path, ["solve", "stations.yaml", "-q", "-o", "calibration.yaml"])
    assert code == 0, said
    return path


def _features():
    """Return features of five pictures, one of them with a long reason why it shows nothing."""
    recording = yaml.safe_load((SAMPLE / "paper-plate" / "recording.yaml").read_text("utf-8"))
    truth = yaml.safe_load((SAMPLE / "paper-plate" / "truth.yaml").read_text("utf-8"))
    camera = recording["camera"] | {"distortion": [0.0] * 5}
    stations = [
        {
            "name": f"a station with a long name {seen['name']}",
            "base_T_gripper": seen["base_T_gripper"],
            "found": True,
            "ids": list(range(36)),
            "pixels": _projected(seen["camera_T_target"], camera),
        }
        for seen in truth["stations"][:5]
    ]
    reason = "31 of 36 discs: the plate leaves the image on the left, and the image is too dark"
    stations[1] = {key: stations[1][key] for key in ("name", "base_T_gripper")}
    stations[1] |= {"found": False, "reason": reason}
    head = {"schema": "handeye/features/1", "setup": "eye-in-hand", "camera": camera}
    return head | {"target": recording["target"], "stations": stations}


def _projected(pose, camera):
    """Return the pixels of the plate's points through a pinhole."""
    x, y, z, w = pose["quaternion"]
    tx, ty, tz = pose["translation"]
    pixels = []
    for k in range(36):
        a, b = 0.005 * (k % 6), 0.005 * (k // 6)
        u = (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + tx
        v = 2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + ty
        depth = 2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + tz
        pixels.append(
            [camera["fx"] * u / depth + camera["cx"], camera["fy"] * v / depth + camera["cy"]]
        )
    return pixels


@pytest.mark.parametrize("line", LINES)
def test_a_report_fits_the_terminal_and_begins_with_the_answer(folder, line):
    code, shown = _in_terminal(folder, line.split(), NO_COLOR="1")
    assert code == 0, shown
    # NO_COLOR forbids colours; bold type and the progress bar's movements are none
    assert not re.search(r"\x1b\[[0-9;]*3[0-9]m", shown)
    lines = ESCAPE.sub("", shown.rpartition("\x1b[2K")[2]).splitlines()
    assert max(map(len, lines)) <= COLUMNS, max(lines, key=len)
    first = next(each.strip() for each in lines if each.strip())
    assert first.startswith(LINES[line])


def test_findings_are_wrapped_between_words_and_coloured(folder):
    _, shown = _in_terminal(folder, ["solve", "exchanged.yaml"])
    assert "\x1b[33mwarning" in shown
    finding = ESCAPE.sub("", shown).partition("warning: ")[2].splitlines()
    assert len(finding) > 1
    assert "[stations-exchanged]" in " ".join(finding)
    assert "exchanged: each fits the robot pose of the other" in " ".join(
        each.strip() for each in finding
    )


def test_findings_in_a_file_are_a_line_each(folder):
    done = subprocess.run(
        [sys.executable, "-m", "handeye_cli", "solve", "exchanged.yaml"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    (warning,) = [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
    assert warning.endswith("[stations-exchanged]")
    assert "\x1b" not in done.stdout + done.stderr
    assert yaml.safe_load(done.stdout)["schema"] == "handeye/calibration/1"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_with_a_result_of_its_own_prints_it_as_json(name):
    groups = groups_of(command_of(import_module(COMMANDS[name]), name)).values()
    fields = {field for group in groups for field in flags_of(group)}
    assert ("json" in fields) is (name not in WITHOUT_JSON)
