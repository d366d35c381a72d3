"""Tables and sentences on narrow terminals: nothing is cut, and numbers stay with their units."""

import io

import numpy as np
import pytest

from handeye_cli.records import Finding
from handeye_cli.render.console import make_console, show_findings, show_paragraph, show_table

HEADINGS = ["station", "rotation\nmrad", "translation\nmm", ""]
ROWS = [
    ["00", "1264.358", "-0.123456", "the plate leaves the image on the left"],
    ["a station with a long name", "2.079 -> 1.856", "5.598 -> 5.569", ""],
]


WORDS = ["plate", "leaves", "the", "image", "on", "left", "station", "with", "a", "long", "name"]


def printed(width, show, terminal=True):
    stream = io.StringIO()
    console = make_console(stream)
    console._force_terminal = terminal
    console.width = width
    show(console)
    return stream.getvalue()


def table(width):
    return printed(width, lambda console: show_table(console, HEADINGS, ROWS, left=[0, 3]), False)


@pytest.mark.parametrize("width", [20, 30, 40, 50, 60, 80, 100])
def test_no_cell_is_cut_at_any_width(width):
    shown = table(width)
    for row in ROWS:
        for number in row[1:3]:
            assert number in shown
    words = " ".join(shown.split())
    for word in WORDS:
        assert f" {word} " in f" {words} "


def test_columns_that_do_not_fit_become_lines_with_their_names():
    lines = [line.rstrip() for line in table(40).splitlines()]
    assert "  station 00" in lines
    assert "    rotation mrad: 1264.358" in lines
    assert "    translation mm: -0.123456" in lines
    assert "    the plate leaves the image on the left" in lines
    assert not any("rotation" in line and "translation" in line for line in lines)


def test_columns_that_fit_stay_beside_each_other():
    lines = table(80).splitlines()
    assert lines[0].split() == ["rotation", "translation"]
    assert lines[2].split()[:3] == ["00", "1264.358", "-0.123456"]


@pytest.mark.parametrize("width", range(12, 60, 3))
def test_no_number_is_parted_from_its_unit(width):
    text = "the robot is off by 1.5 mm and 0.31 mrad, which is 62 % of all, at 40 deg and 0.13 px"
    lines = printed(width, lambda console: show_paragraph(console, text)).splitlines()
    assert " ".join(line.strip() for line in lines) == text
    assert max(map(len, lines)) <= width
    for line in lines[1:]:
        assert line.split()[0] not in {"mm", "mrad,", "mrad", "%", "deg", "px"}


def test_a_flag_is_not_broken_at_its_hyphens():
    finding = Finding("code", "info", "seen", "run it again with --calibrate-intrinsics, please")
    shown = printed(32, lambda console: show_findings(console, [finding]))
    assert "--calibrate-intrinsics," in shown


def test_a_file_gets_unbroken_sentences():
    text = " ".join(["word"] * 40)
    shown = printed(40, lambda console: show_paragraph(console, text, margin="  "), False)
    assert shown.rstrip("\n") == f"  {text}"


def test_random_tables_keep_every_number():
    rng = np.random.default_rng(5)
    rows = [[f"{i:02d}", *(f"{x:.3f}" for x in 1e4 * rng.normal(size=6))] for i in range(5)]
    headings = ["station", *"xyz", "axis x", "axis y", "axis z"]
    for width in range(10, 100, 7):
        shown = printed(
            width, lambda console: show_table(console, headings, rows, left=[0]), terminal=False
        )
        assert all(number in shown for row in rows for number in row[1:])
