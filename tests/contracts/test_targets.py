"""What every target must keep, the ones to come included."""

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import TargetSpec


@pytest.fixture(params=targets.TYPES)
def board(request):
    return targets.build(targets.parse(targets.board_class(request.param).EXAMPLE))


def test_the_table_names_the_type_of_its_class():
    assert [targets.board_class(name).TYPE for name in targets.TYPES] == list(targets.TYPES)


def test_points_are_flat_distinct_and_in_metres(board):
    points = board.points()
    assert points.dtype == np.float64
    assert points.shape[1] == 3
    assert len(points) >= 4
    assert not points[:, 2].any()
    assert points[0].tolist() == [0, 0, 0]
    assert points.min() >= 0
    assert points.max() < 1.0
    assert len(np.unique(points, axis=0)) == len(points)
    assert np.linalg.matrix_rank(points[:, :2]) == 2


def test_turns_are_rigid_renumberings_and_a_group_with_the_identity_first(board):
    points, turns = board.points(), board.turns()
    every = np.arange(len(points))
    np.testing.assert_array_equal(turns[0], every)
    distances = np.linalg.norm(points[:, None] - points[None], axis=-1)
    for turn in turns:
        np.testing.assert_array_equal(np.sort(turn), every)
        np.testing.assert_allclose(distances[np.ix_(turn, turn)], distances, atol=1e-12)
        # no mirroring: the triangle of three points keeps its sense
        a, b = points[1] - points[0], points[-1] - points[0]
        c, d = points[turn[1]] - points[turn[0]], points[turn[-1]] - points[turn[0]]
        assert np.cross(a, b)[2] == pytest.approx(np.cross(c, d)[2])
    rows = {tuple(turn) for turn in turns}
    assert len(rows) == len(turns)
    assert {tuple(p[q]) for p in turns for q in turns} == rows


def test_the_shorthand_and_the_keys_lead_back_to_the_board(board):
    assert targets.parse(targets.shorthand(board.spec)) == board.spec
    assert targets.build(board.spec) == board
    assert targets.shorthand(board.spec) == board.EXAMPLE


def test_an_unknown_key_is_refused(board):
    spec = TargetSpec(board.TYPE, {**board.spec.parameters, "spacing_inch": 1})
    with pytest.raises(InputError, match="found 'spacing_inch'"):
        targets.build(spec)


@pytest.mark.parametrize("value", [None, [], {}, "", -1, 0.0, float("inf")])
def test_no_value_of_a_key_is_a_crash(board, value):
    for key in board.spec.parameters:
        with pytest.raises(InputError, match=r"target: expected .*found"):
            targets.build(TargetSpec(board.TYPE, {**board.spec.parameters, key: value}))


def test_a_shorthand_that_stops_early_is_refused(board):
    with pytest.raises(UsageError, match="such as"):
        targets.parse(board.EXAMPLE.rpartition(":")[0])


def images():
    rng = np.random.default_rng(5)
    yield "black", np.zeros((120, 160), np.uint8)
    yield "grey", np.full((120, 160), 128, np.uint8)
    yield "noise", np.clip(rng.normal(128, 25, (120, 160)), 0, 255).astype(np.uint8)
    yield "stripes", np.tile(np.repeat(np.array([0, 255], np.uint8), 8), (120, 10))
    yield "one pixel", np.zeros((1, 1), np.uint8)
    yield "narrow", np.zeros((200, 3), np.uint8)


@pytest.mark.parametrize("image", [pytest.param(image, id=name) for name, image in images()])
def test_an_image_without_the_target_gives_a_reason(board, image):
    before = image.copy()
    seen = board.detect(image)
    assert seen.reason
    assert "\n" not in seen.reason
    assert seen.ids.shape == (0,)
    assert seen.pixels.shape == (0, 2)
    np.testing.assert_array_equal(image, before)
