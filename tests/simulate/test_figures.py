"""The paper's figures: what is varied, that nothing else is, and that the points lie on lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation
from simulate.paper_setting import PAPER

from handeye_cli.errors import UsageError
from handeye_cli.records.simulation import FIGURES, Abscissa
from handeye_cli.simulate.figures import simulate_figures, straight_line, sweep
from handeye_cli.simulate.trials import simulate

TRIALS = 500


@pytest.fixture(scope="module")
def figures():
    return {
        figure.number: figure for figure in simulate_figures(range(8, 14), PAPER, TRIALS, 0).figures
    }


def turns(layout):
    """Rotation vectors of the first two steps from station to station, seen from the target."""
    R = Rotation.from_matrix(layout.target_T_camera[:3, :3, :3])
    return [(R[k + 1] * R[k].inv()).as_rotvec() for k in range(2)]


def distances(layout):
    return np.linalg.norm(layout.target_T_camera[:, :3, 3], axis=1)


def test_interstation_angles():
    points = list(sweep(Abscissa.ANGLE, PAPER))
    assert [x for x, _ in points] == pytest.approx(np.linspace(1, 5, 9))
    for x, layout in points:
        assert np.linalg.norm(turns(layout), axis=1) == pytest.approx([1 / x, 1 / x])
        assert distances(layout) == pytest.approx([PAPER.distance] * 3)
        assert len(layout.pairs) == 3


@pytest.mark.parametrize("stations", [5, 8])
def test_interstation_angles_of_more_stations(stations):
    for x, layout in sweep(Abscissa.ANGLE, replace(PAPER, stations=stations)):
        R = Rotation.from_matrix(layout.target_T_camera[:, :3, :3])
        angles = [(R[int(j)] * R[int(i)].inv()).magnitude() for i, j in layout.pairs]
        assert 1 / np.sqrt(np.mean(np.square(angles))) == pytest.approx(x)


def test_angles_between_axes():
    points = list(sweep(Abscissa.AXES, PAPER))
    steps = []
    for x, layout in points:
        first, second = turns(layout)
        sine = np.linalg.norm(np.cross(first, second))
        assert x == pytest.approx(np.linalg.norm(first) * np.linalg.norm(second) / sine)
        steps += [np.linalg.norm(first), np.linalg.norm(second)]
        assert distances(layout) == pytest.approx([PAPER.distance] * 3)
    # 51.8 deg is the angle of three stations tilted by 30 deg
    assert np.degrees(steps) == pytest.approx([51.8] * 18, abs=0.05)
    assert np.all(np.diff([x for x, _ in points]) > 0.4)
    assert points[0][0] < 1.2
    assert points[-1][0] > 5.5


def test_distances():
    points = list(sweep(Abscissa.DISTANCE, PAPER))
    for x, layout in points:
        assert distances(layout) == pytest.approx([x] * 3)
    assert points[0][0] < 0.2 * PAPER.distance
    assert points[-1][0] > 2 * PAPER.distance


@pytest.mark.parametrize(("pairs", "fewest", "most"), [("star", 3, 41), ("all", 3, 820)])
def test_numbers_of_pairs(pairs, fewest, most):
    points = list(sweep(Abscissa.PAIRS, replace(PAPER, pairs=pairs)))
    assert [x for x, _ in points] == pytest.approx([len(each.pairs) ** -0.5 for _, each in points])
    assert [len(points[k][1].pairs) for k in (-1, 0)] == [fewest, most]


@pytest.mark.parametrize("number", FIGURES)
def test_points_rise_and_lie_on_a_straight_line(figures, number):
    figure = figures[number]
    x, rms = np.array([(point.abscissa, point.rms) for point in figure.points]).T
    assert len(x) == 9
    assert np.all(np.diff(x) > 0)
    expected = stats.linregress(x, rms)
    assert figure.line.slope == pytest.approx(expected.slope)
    assert figure.line.intercept == pytest.approx(expected.intercept)
    assert figure.line.r_squared == pytest.approx(expected.rvalue**2)
    assert figure.line.r_squared > (0.95 if number == 11 else 0.97)


@pytest.mark.parametrize("number", FIGURES)
def test_errors_lie_between_the_bound_and_the_papers_prediction(figures, number):
    for point in figures[number].points:
        # an RMS of 500 trials is told to some 2.5 %
        assert 0.92 * point.bound < point.rms < 1.08 * point.predicted
        assert 1.8 * point.rms < point.largest < 5 * point.rms


def test_errors_go_with_the_inverse_root_of_the_number_of_stations(figures):
    for number in (12, 13):
        line = figures[number].line
        assert abs(line.intercept) < 0.1 * figures[number].points[-1].rms


def test_the_distance_dominates_far_away_and_not_near_the_target(figures):
    points = figures[11].points
    near = points[1].rms - points[0].rms
    far = points[-1].rms - points[-2].rms
    assert far > 2 * near
    assert points[0].rms > figures[11].line.intercept  # the bend near the origin


def test_a_point_is_the_setting_with_one_value_changed(figures):
    point = figures[13].points[-3]  # seven stations
    alone = simulate(replace(PAPER, stations=7), 2000, 21).errors
    assert point.abscissa == pytest.approx(7**-0.5)
    assert point.rms == pytest.approx(alone.rotation_rms, rel=0.1)
    assert point.predicted == pytest.approx(alone.predicted.rotation)
    assert point.bound == pytest.approx(alone.bound.rotation, rel=0.02)


def test_figures_of_one_sweep_show_the_same_trials_alone_and_together(figures):
    alone = simulate_figures([9], PAPER, TRIALS, 0).figures
    assert alone == (figures[9],)
    assert [p.abscissa for p in figures[9].points] == [p.abscissa for p in figures[8].points]


def test_a_straight_line_through_errors_that_are_all_the_same():
    line = straight_line(np.arange(4.0), np.zeros(4))
    assert (line.slope, line.intercept, line.r_squared) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("number", [7, 14])
def test_other_figures_are_refused(number):
    with pytest.raises(UsageError, match=f"a figure of 8 to 13, found {number}"):
        simulate_figures([number], PAPER, 10, 0)


def test_a_setting_is_checked_for_figures_too():
    with pytest.raises(UsageError, match="found 0"):
        simulate_figures([8], PAPER, 0, 0)
