"""Observations as padded arrays, and what one bad view does to the evidence of the others."""

from dataclasses import replace

import numpy as np
import pytest
from pictures import CAMERA, grid, shoot

from handeye_cli.errors import InputError
from handeye_cli.records import Observation
from handeye_cli.views import pose_candidates, views_of

POINTS = grid(6, 6, 0.005)


def stations(bad_px=0.0):
    """Eight views of a plate, the last of which has pixels that are off by noise of their own."""
    rng = np.random.default_rng(3)
    rows = list(shoot(rng, 8, distance=0.3, sigma_px=0.1).features.stations)
    seen = rows[-1].observation
    noise = bad_px * np.random.default_rng(4).normal(size=seen.pixels.shape)
    rows[-1] = replace(rows[-1], observation=replace(seen, pixels=seen.pixels + noise))
    return rows


def test_one_bad_view_leaves_the_others_sure_of_their_poses():
    good, bad = (
        pose_candidates(views_of(stations(px), POINTS), CAMERA).penalties[:-1, 1]
        for px in (0.0, 5.0)
    )
    two = np.isfinite(good)
    assert two.sum() >= 4
    np.testing.assert_allclose(bad[two], good[two], rtol=0.2)


def test_every_view_has_its_own_points():
    rows = stations()
    ids = np.array([3, 7, 8, 30])
    rows[2] = replace(rows[2], observation=Observation(ids, rows[2].observation.pixels[ids]))
    rows[5] = replace(rows[5], observation=None, reason="fog")
    views = views_of(rows, POINTS)
    np.testing.assert_array_equal(views.index, [0, 1, 2, 3, 4, 6, 7])
    np.testing.assert_array_equal(np.flatnonzero(views.seen.mask[2]), ids)
    part = views.seen.part(np.array([2, 4]))
    np.testing.assert_array_equal(part.mask, views.seen.mask[[2, 4]])
    np.testing.assert_array_equal(part.pixels, views.seen.pixels[[2, 4]])
    assert part.points is views.seen.points


def test_points_that_the_target_has_not_are_refused():
    rows = stations()
    seen = rows[1].observation
    rows[1] = replace(rows[1], observation=replace(seen, ids=seen.ids + 1))
    with pytest.raises(InputError, match="0 to 35, found 36") as caught:
        views_of(rows, POINTS)
    assert caught.value.where == 'station "01"'
