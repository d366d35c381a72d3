"""The picture of a plan: stations where they are, in the colours of their purposes."""

import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest

from handeye_cli.errors import UsageError
from handeye_cli.plan import plan
from handeye_cli.records import PlannedStation
from handeye_cli.render.plan_plot import plan_png

BLUE = (178, 114, 0)


def decoded(png):
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)


def dots(picture, colour):
    """The (n, 2) middles u, v of the dots of a colour above the legend, from left to right."""
    near = np.all(np.abs(picture.astype(int) - colour) < 12, axis=-1)
    count, _, boxes, middles = cv2.connectedComponentsWithStats(near.astype(np.uint8))
    large = [k for k in range(1, count) if boxes[k, cv2.CC_STAT_AREA] > 12]
    kept = [middles[k] for k in large if middles[k][1] < 0.9 * len(picture)]
    return np.array(sorted(map(tuple, kept)))


def test_a_picture_is_a_readable_png():
    pytest.importorskip("matplotlib")
    planned = plan(7, verification=3)
    png = plan_png(planned)
    height, width = decoded(png).shape[:2]
    assert 400 <= height <= 600
    assert 800 <= width <= 1200
    assert 20_000 < len(png) < 150_000
    assert plan_png(planned) == png


def test_stations_are_drawn_in_both_views_where_they_are():
    pytest.importorskip("matplotlib")
    circle = plan(3).stations[0].target_T_camera
    places = np.array([[-0.1, -0.05, -0.2], [0.0, 0.1, -0.3], [0.1, 0.0, -0.25]])
    stations = []
    for k, place in enumerate(places):
        pose = circle.copy()
        pose[:3, 3] = place
        stations.append(PlannedStation(f"0{k}", pose))
    found = dots(decoded(plan_png(replace(plan(3), stations=tuple(stations)))), BLUE)
    assert len(found) == 6
    for view, plane in ((found[:3], [0, 1]), (found[3:], [0, 2])):
        # x to the right; y of the view from above, and z of the other, downwards: one scale
        drawn, real = view - view[0], (places - places[0])[:, plane]
        scale = drawn[2, 0] / real[2, 0]
        assert scale > 0.0
        assert drawn == pytest.approx(scale * real, abs=1.0)


def test_stations_to_verify_on_are_of_another_colour():
    pytest.importorskip("matplotlib")
    with_rings, without = (decoded(plan_png(plan(5, verification=n))) for n in (4, 0))
    # rings of one pixel fade into white, and stay far redder than they are blue
    red, none = (np.sum(p[..., 2].astype(int) - p[..., 0] > 90) for p in (with_rings, without))
    assert red > 8 * 10
    assert none == 0


def test_the_way_is_drawn_when_there_is_one():
    pytest.importorskip("matplotlib")
    planned = plan(5)
    ordered = replace(planned, order=("00", "02", "04", "01", "03"))
    assert plan_png(ordered) != plan_png(planned)


def test_without_matplotlib_a_hint_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UsageError, match="no module 'matplotlib'"):
        plan_png(plan(3))
