"""Rays and a paraboloid: they meet where they were sent to, and what turns away is refused."""

import math

import numpy as np
import pytest

from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.simulate.bowed import FLAT, Bow, bow_of, require_seen

GRID = np.stack(np.meshgrid(np.linspace(-0.05, 0.07, 41), np.linspace(-0.06, 0.04, 31)), axis=-1)
BOWS = [
    FLAT,
    Bow(np.array([0.01, -0.02]), 2.0, -0.003),
    Bow(np.array([0.01, -0.02]), 9.0, -0.01),
    Bow(np.array([0.01, -0.02]), -2.0, 0.003),
    Bow(np.array([0.01, -0.02]), -9.0, 0.01),
]
ORIGINS = np.array([[0.01, -0.02, -0.2], [0.15, 0.1, -0.2], [-0.3, 0.05, -0.1]])


def rays_to(bow, origin, places):
    way = bow.lifted(places) - origin
    return way[..., :2] / way[..., 2:]


@pytest.mark.parametrize("origin", ORIGINS, ids=str)
@pytest.mark.parametrize("bow", BOWS, ids=lambda bow: f"{bow.slope:g}")
def test_a_ray_meets_the_place_it_was_sent_to(bow, origin):
    ahead = (bow.lifted(GRID) - origin)[..., 2] > 1e-3
    seen = ahead & (bow.sines(origin, GRID) > 0.01)
    assert seen.mean() > 0.05
    found = bow.met(origin, rays_to(bow, origin, GRID[seen]))
    assert found == pytest.approx(GRID[seen], abs=1e-10)


@pytest.mark.parametrize("origin", ORIGINS, ids=str)
@pytest.mark.parametrize("bow", BOWS, ids=lambda bow: f"{bow.slope:g}")
def test_whatever_a_ray_meets_lies_ahead_on_it_and_shows_its_front(bow, origin):
    """Rays in all directions; those that miss end where the surface vanishes from sight."""
    spread = np.repeat([0.3, 4.0], 2000)[:, None]
    rays = spread * np.random.default_rng(3).normal(size=(4000, 2))
    places = bow.met(origin, rays)
    assert np.all(np.isfinite(places))
    way = bow.lifted(places) - origin
    met = np.linalg.norm(way[:, :2] - way[:, 2:] * rays, axis=1) < 1e-9 * (1.0 + np.abs(way[:, 2]))
    assert met.mean() > 0.02
    assert np.all(way[met, 2] > 0.0)
    sines = bow.sines(origin, places)
    assert np.all(sines[met] > -1e-6)
    assert sines[~met] == pytest.approx(np.zeros(np.sum(~met)), abs=1e-6)


def test_a_hardly_bowed_target_is_met_as_a_flat_one():
    rays = np.random.default_rng(4).normal(0.0, 0.5, (100, 2))
    barely = Bow(np.array([0.01, -0.02]), 1e-9, 0.0)
    for origin in ORIGINS:
        assert barely.met(origin, rays) == pytest.approx(FLAT.met(origin, rays), abs=1e-9)


def test_sines_are_those_between_ray_and_surface():
    bow, origin, h = BOWS[2], ORIGINS[1], 1e-6
    across, down = (
        (bow.lifted(GRID + step) - bow.lifted(GRID - step)) / (2.0 * h)
        for step in (np.array([h, 0.0]), np.array([0.0, h]))
    )
    normal = np.cross(across, down)
    ray = bow.lifted(GRID) - origin
    cosine = np.sum(normal * ray, axis=-1)
    cosine /= np.linalg.norm(normal, axis=-1) * np.linalg.norm(ray, axis=-1)
    assert bow.sines(origin, GRID) == pytest.approx(cosine, abs=1e-7)


def test_a_bow_keeps_the_mean_depth_and_stands_out_by_its_height():
    points = np.pad(GRID.reshape(-1, 2), ((0, 0), (0, 1)))
    bow = bow_of(points, 2e-3)
    z = bow.depth(points[:, :2])
    assert z.mean() == pytest.approx(0.0, abs=1e-15)
    assert z.max() - bow.depth(bow.centre) == pytest.approx(2e-3)
    assert bow_of(points, 0.0) is FLAT


def tilted(degrees):
    R = rotations.exp(np.array([math.radians(degrees), 0.0, 0.0]))
    return se3.from_parts(R, np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize(("slope", "lean"), [(1.0, 1), (-1.0, -1)])
def test_the_limit_is_where_a_place_is_seen_at_ten_degrees(slope, lean):
    """Seen from very far: the rim at 0.1 m leans by another atan 0.2."""
    bow, extent = Bow(np.zeros(2), slope, 0.0), np.array([[0.0, -0.1], [0.0, 0.1]])
    pose = tilted(lean * (80.0 - math.degrees(math.atan(0.2)) - 0.5))
    pose[2, 3] = 1e4
    require_seen(bow, pose, extent)
    pose[:3, :3] = tilted(lean * (80.0 - math.degrees(math.atan(0.2)) + 0.5))[:3, :3]
    with pytest.raises(
        UsageError, match=r"10 deg or more from its surface, found 9\.5 deg"
    ) as caught:
        require_seen(bow, pose, extent)
    assert caught.value.where == "--fault bowed"
    assert "smaller bow" in caught.value.hint


def test_a_flat_target_is_never_refused():
    require_seen(FLAT, tilted(89.0), np.array([[-0.1, -0.1], [0.1, 0.1]]))
