"""Limits of a cell against their definitions, place by place."""

import cv2
import numpy as np
import pytest
from planning.rigs import AIM, CAMERA, DISTANCE, FRAMES, PLATE, TILT, cell, circle

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.planning import views
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.options import Limits
from handeye_cli.records import Camera

NOBODY = np.zeros((0, 3, 3))


def random_views(count=300, seed=7):
    rng = np.random.default_rng(seed)
    at = rng.normal(size=(count, 6)) * [0.4, 0.4, 1.5, 0.0, 0.1, 0.1]
    at[:, views.DISTANCE] = rng.uniform(0.06, 0.4, count)
    return at


def excess_of(name, at, others=NOBODY, **limits):
    """Excess of one limit in its own unit, radians, metres or pixels."""
    where = cell(distance=(0.0, 1.0), **limits)
    column = where.names.index(name)
    scale = where.limits[column].scale if column < len(where.limits) else 1.0
    return where.excess(where.places(at), others)[:, column] * scale


def test_the_view_is_the_plates_pixels_as_opencv_projects_them():
    at = random_views()
    found = excess_of("view", at, margin=10.0)
    K = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1.0]])
    for pose, excess in zip(se3.inverse(views.cameras_of(at, AIM)), found, strict=True):
        pixels = cv2.projectPoints(PLATE, cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3], K, None)[0]
        overshoot = np.maximum(10.0 - pixels, pixels - [[[639 - 10.0, 479 - 10.0]]]).max()
        assert excess == pytest.approx(max(overshoot, 0.0), abs=1e-6)
    assert 0.2 < np.mean(found > 0.0) < 0.9


def test_a_lens_that_folds_back_shows_nothing_there():
    barrel = Camera(640, 480, 400.0, 400.0, 319.5, 239.5, (-0.3,))
    from functools import partial

    from handeye_cli.planning.limits import cell_of

    where = cell_of(
        Limits(), FRAMES, cameras_of=partial(views.cameras_of, aim=AIM), aim=AIM,
        distance=(0.0, 1.0), points=PLATE, camera=barrel,
    )  # fmt: skip
    aside = circle(1)
    aside[:, 5] = np.arctan(1.75)  # 400 (1.75 - 0.3 * 1.75^3) is near 60 pixels: inside again
    assert where.excess(where.places(aside), NOBODY)[0, where.names.index("view")] > 0.0


def test_depth_counts_every_point_of_the_target():
    at = random_views()
    found = excess_of("depth", at, depth=(0.1, 0.2))
    z = se3.transform_points(se3.inverse(views.cameras_of(at, AIM)), PLATE)[..., 2]
    expected = np.maximum(np.maximum(0.1 - z.min(axis=1), z.max(axis=1) - 0.2), 0.0)
    assert found == pytest.approx(expected)


def test_tilt_and_roll():
    at = random_views()
    tilt = excess_of("max-tilt", at, max_tilt=0.3)
    assert tilt == pytest.approx(np.maximum(np.hypot(at[:, 0], at[:, 1]) - 0.3, 0.0))
    roll = excess_of("max-roll", at, max_roll=0.8)
    around = np.abs((at[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    assert roll == pytest.approx(np.maximum(around - 0.8, 0.0), abs=1e-12)


def test_limits_of_the_gripper():
    at = random_views()
    robot = FRAMES.grippers(views.cameras_of(at, AIM))
    box = np.array([[0.5, -0.1, 0.1], [0.7, 0.2, 0.3]])
    nearest = np.clip(robot[:, :3, 3], *box)
    expected = np.linalg.norm(robot[:, :3, 3] - nearest, axis=1)
    assert excess_of("box", at, box=box) == pytest.approx(expected)
    assert np.any(expected == 0.0)
    far = np.linalg.norm(robot[:, :3, 3], axis=1)
    assert excess_of("reach", at, reach=0.7) == pytest.approx(np.maximum(far - 0.7, 0.0))
    down = np.degrees(np.arccos(np.clip(-robot[:, 2, 2], -1.0, 1.0)))
    cone = np.array([0.0, 0.0, -2.0, np.radians(40.0)])
    turned = np.degrees(excess_of("cone", at, cone=cone))
    assert turned == pytest.approx(np.maximum(down - 40.0, 0.0), abs=1e-5)


def test_limits_between_stations():
    at = random_views(60)
    R = FRAMES.grippers(views.cameras_of(at, AIM))[:, :3, :3]
    one, others = at[:40], R[40:]
    turn = R[:40, None] @ np.swapaxes(others, -1, -2)
    vectors = np.array([[cv2.Rodrigues(each)[0][:, 0] for each in row] for row in turn])
    about_y = np.abs(vectors[..., 1]).max(axis=1)
    found = excess_of("avoid-axis", one, others, avoid_axis=(1, 0.2))
    assert found == pytest.approx(np.maximum(about_y - 0.2, 0.0), abs=1e-7)
    least = np.linalg.norm(vectors, axis=2).min(axis=1)
    found = excess_of("min-rotation", one, others, min_rotation=1.2)
    assert found == pytest.approx(np.maximum(1.2 - least, 0.0), abs=1e-7)


def test_the_rotation_between_stations_needs_no_robot():
    at = circle(5)
    free = cell(Frames(Setup.EYE_IN_HAND), min_rotation=2.0)
    known = cell(FRAMES, min_rotation=2.0)
    found = [
        where.excess(where.places(at[:2]), where.places(at[2:]).turned)[:, -1]
        for where in (free, known)
    ]
    assert found[0] == pytest.approx(found[1])
    assert found[0].min() > 0.0


@pytest.mark.parametrize(
    ("limits", "flag"),
    [
        ({"box": np.zeros((2, 3))}, "--box"),
        ({"reach": 1.0}, "--reach"),
        ({"cone": np.ones(4)}, "--cone"),
        ({"avoid_axis": (0, 0.1)}, "--avoid-axis"),
    ],
)
def test_limits_of_the_gripper_need_its_poses(limits, flag):
    with pytest.raises(UsageError, match=f"{flag} limits the gripper"):
        cell(Frames(Setup.EYE_IN_HAND), **limits)


def test_a_margin_needs_a_camera():
    with pytest.raises(UsageError, match="--margin-px 12 needs"):
        cell(sees=False, margin=12.0)


def test_the_circle_keeps_what_it_should():
    where = cell(max_tilt=TILT + 1e-9, depth=(0.1, 0.3))
    at = circle(7)
    assert np.all(where.excess(where.places(at), NOBODY) == 0.0)
    tight = cell(distance=(DISTANCE + 0.01, 1.0))
    column = tight.names.index("distance")
    assert tight.in_words(column, tight.excess(tight.places(at), NOBODY)[0, column]) == "10 mm"
