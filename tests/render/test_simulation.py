"""The report of simulations, and their figures as pictures."""

import io
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from documents.simulations import BASE, ERRORS, FIGURES

from handeye_cli.errors import UsageError
from handeye_cli.render.console import make_console
from handeye_cli.render.figure_plot import figure_png
from handeye_cli.render.report import show


def shown(record):
    stream = io.StringIO()
    show(record, make_console(stream))
    return [line.rstrip() for line in stream.getvalue().splitlines()]


def test_one_setting():
    assert shown(replace(BASE, errors=ERRORS)) == [
        "1000 simulated calibrations (shah, seed 7)",
        "3 stations tilted by 30.00 deg, 168.910 mm from the target, pairs: all",
        "Gripper to camera 241.300 mm, in any direction",
        "Noise, RMS: robot 1.500 mrad and 0.127 mm, camera 0.333 mrad and 0.076 mm",
        "",
        "                             rotation  translation",
        "                                 mrad           mm      mil",
        "  RMS                           3.150        0.688   27.087",
        "  largest                       3.333        1.414   55.678",
        "  paper's formulas, RMS         4.400        1.300   51.181",
        "  paper's formulas, largest    20.000       25.000  984.252",
        "  Cramer-Rao bound, RMS         2.780        0.570   22.441",
        "",
    ]


def test_a_figure_of_angles():
    lines = shown(replace(BASE, figures=FIGURES[:1]))
    assert lines[0] == "1000 simulated calibrations in each point (shah, seed 7)"
    assert lines[5:] == [
        "Figure 8: rotation error in mrad",
        "against 1 / interstation angle; varied: tilt",
        "",
        "  abscissa",
        "     1/rad    RMS  largest  paper  bound",
        "     0.333  3.000    9.000  4.000  2.500",
        "     0.500  4.000  100.000  5.000  0.000",
        "",
        "  Line through the RMS: 6.000 mrad per unit, -1.000 mrad at 0; R2 0.3333",
        "",
    ]


def test_a_figure_of_lengths_among_all():
    lines = shown(replace(BASE, figures=FIGURES))
    start = lines.index("Figure 11: translation error in mm")
    assert lines[start + 1] == "against distance from camera to target; varied: distance"
    assert lines[start + 5].split() == ["333.333", "3.000", "9.000", "4.000", "2.500"]
    assert "0.00600 mm per mm, -1.000 mm at 0" in lines[start + 8]
    assert sum(line.startswith("Figure ") for line in lines) == 6


def decoded(png):
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)


@pytest.mark.parametrize("figure", FIGURES[2:4], ids=["10", "11"])
def test_a_picture_is_a_readable_png(figure):
    pytest.importorskip("matplotlib")
    png = figure_png(figure, BASE)
    picture = decoded(png)
    assert 400 <= picture.shape[0] <= 800
    assert 600 <= picture.shape[1] <= 1000
    assert 10_000 < len(png) < 60_000
    assert figure_png(figure, BASE) == png


def test_a_picture_shows_the_errors_where_they_are():
    """The blue dots of the RMS errors, found by their colour, lie on the line of the data."""
    pytest.importorskip("matplotlib")
    points = tuple(replace(FIGURES[0].points[0], abscissa=x, rms=1e-3 * x) for x in (1.0, 2.0, 4.0))
    line = replace(FIGURES[0].line, slope=0.0, intercept=-1.0)  # out of the picture
    picture = decoded(figure_png(replace(FIGURES[0], points=points, line=line), BASE))
    blue = np.all(np.abs(picture.astype(int) - [178, 114, 0]) < 12, axis=-1)
    count, _, boxes, centres = cv2.connectedComponentsWithStats(blue.astype(np.uint8))
    dots = [centres[k] for k in range(1, count) if boxes[k, cv2.CC_STAT_AREA] > 30]
    u, v = np.array(sorted(map(tuple, dots)))[-3:].T  # that of the legend is at the left
    assert (u[2] - u[1]) / (u[1] - u[0]) == pytest.approx(2.0, abs=0.03)
    assert (v[1] - v[2]) / (v[0] - v[1]) == pytest.approx(2.0, abs=0.1)


def test_without_matplotlib_a_hint_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UsageError, match="no module 'matplotlib'") as caught:
        figure_png(FIGURES[0], BASE)
    assert caught.value.hint == 'install it with: pip install "handeye-cli[plot]"'
