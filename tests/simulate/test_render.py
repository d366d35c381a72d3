"""Drawn pictures against closed forms and against counting thousands of points in each pixel."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import convolve1d

from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, paint_target, render_target
from handeye_cli.targets.drawing import Drawing, checkers

PLAIN = Camera(120, 100, 500.0, 500.0, 60.2, 49.7)
SMALL = Camera(48, 40, 400.0, 397.0, 24.3, 19.1, (-0.15, 0.05, 0.002, -0.001, 0.02))
TILTED = se3.from_parts(
    rotations.exp(np.array([0.0, 0.0, 0.35])) @ rotations.exp(np.array([0.45, -0.5, 0.0])),
    np.array([-0.0065, -0.003, 0.2]),
)
DISCS = np.array([[0, 0, 3.5], [8, 0, 2], [0, 8, 2], [8, 8, 2]]) / 1000
SQUARES = checkers(4, 3, 0.004) - 0.0015
OUTLINE = np.array([[-0.0055, -0.0055], [0.0145, 0.0125]])
PLATE = Drawing(DISCS, outline=OUTLINE)
BOARD = Drawing(rectangles=SQUARES, outline=OUTLINE)


def in_front(x: float, y: float, z: float) -> np.ndarray:
    return se3.from_parts(np.eye(3), np.array([x, y, z]))


def darkness(camera, pose, centre, radius, blur) -> np.ndarray:
    """Coverage of one disc on endless paper."""
    look = Appearance(blur_px=blur)
    disc = Drawing(np.array([[*centre[:2], radius]]))
    grey = paint_target(camera, pose, disc, appearance=look)
    return (look.paper - grey) / (look.paper - look.ink)


@pytest.mark.parametrize("blur", [0.0, 0.7, 1.5])
@pytest.mark.parametrize("seed", range(4))
def test_facing_disc_has_its_area_and_centre(blur, seed):
    rng = np.random.default_rng(seed)
    distance, radius = rng.uniform(0.15, 0.25), rng.uniform(0.002, 0.01)
    x, y = rng.uniform(-0.005, 0.005, 2)
    coverage = darkness(PLAIN, in_front(x, y, distance), [0.0, 0.0, 0.0], radius, blur)
    radius_px = 500.0 * radius / distance
    v, u = np.mgrid[0:100, 0:120]
    centroid = np.array([np.sum(coverage * u), np.sum(coverage * v)]) / coverage.sum()
    expected = 500.0 * np.array([x, y]) / distance + [60.2, 49.7]
    # A cell's straight edge cuts 1 / (24 radius) of a squared cell off the arc it stands for.
    area_error = 2 * (1 / 4) ** 2 / (24 * radius_px**2)
    assert coverage.sum() == pytest.approx(math.pi * radius_px**2, rel=area_error + 5e-6)
    # Without blur, what a pixel sees of the edge counts at the pixel's centre, not where it is.
    assert centroid == pytest.approx(expected, abs=1e-4 if blur else 2e-3)


def undistorted(camera: Camera, pixels: np.ndarray) -> np.ndarray:
    """Directions of pixels by fixed-point iteration on the distortion's own definition."""
    k1, k2, p1, p2, k3 = camera.distortion
    wanted = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    xy = wanted
    for _ in range(8):
        x, y = xy[..., 0], xy[..., 1]
        r2 = x * x + y * y
        radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3)[..., None]
        bent = [2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y]
        xy = (wanted - np.stack(bent, axis=-1)) / radial
    return xy


def counted(
    camera: Camera, pose: np.ndarray, drawing: Drawing, appearance: Appearance, n: int
) -> np.ndarray:
    """The same picture from n x n points in each pixel and a sampled Gaussian."""
    margin = math.ceil(5 * appearance.blur_px)
    columns, rows = (
        (np.arange(-margin * n, (size + margin) * n) + 0.5) / n - 0.5
        for size in (camera.width, camera.height)
    )
    xy = undistorted(camera, np.stack(np.meshgrid(columns, rows), axis=-1))
    homography = np.linalg.inv(pose[:3, [0, 1, 3]])
    plate = xy @ homography[:, :2].T + homography[:, 2]
    plate = plate[..., :2] / plate[..., 2:]
    on_plate = np.all((plate > drawing.outline[0]) & (plate < drawing.outline[1]), axis=-1)
    grey = np.where(on_plate, appearance.paper, appearance.background)
    for x, y, radius in drawing.discs:
        grey[np.linalg.norm(plate - [x, y], axis=-1) < radius] = appearance.ink
    for rectangle in drawing.rectangles:
        grey[np.all((plate > rectangle[:2]) & (plate < rectangle[2:]), axis=-1)] = appearance.ink
    if margin:
        offsets = np.arange(-margin * n, margin * n + 1) / n
        weights = np.exp(-0.5 * (offsets / appearance.blur_px) ** 2)
        for axis in (0, 1):
            grey = convolve1d(grey, weights / weights.sum(), axis)
        grey = grey[margin * n : -margin * n, margin * n : -margin * n]
    return grey.reshape(camera.height, n, camera.width, n).mean(axis=(1, 3))


@pytest.mark.parametrize(
    ("drawing", "blur", "n", "worst", "typical"),
    [
        (PLATE, 0.7, 16, 1.0, 0.1),
        (BOARD, 0.7, 16, 1.0, 0.1),
        # Sharp, a pixel has 1024 points, of which an edge misjudges up to about one row of 32.
        (PLATE, 0.0, 32, 170 / 32, 0.4),
    ],
    ids=["discs", "squares", "sharp discs"],
)
def test_tilted_plate_through_a_distorting_lens_against_counting(drawing, blur, n, worst, typical):
    appearance = Appearance(blur_px=blur)
    drawn = paint_target(SMALL, TILTED, drawing, appearance=appearance)
    difference = drawn - counted(SMALL, TILTED, drawing, appearance, n)
    assert np.ptp(drawn) > 150.0
    assert np.abs(difference).max() < worst
    assert np.sqrt(np.mean(difference**2)) < typical


@pytest.mark.parametrize("drawing", [PLATE, BOARD], ids=["discs", "squares"])
def test_part_of_a_larger_picture_is_the_smaller_picture(drawing):
    window = replace(SMALL, width=30, height=25, cx=SMALL.cx - 9, cy=SMALL.cy - 7)
    whole, part = (paint_target(camera, TILTED, drawing) for camera in (SMALL, window))
    # plate points lie between other knots: that moves an edge by some millionths of a pixel
    assert part == pytest.approx(whole[7:32, 9:39], abs=1e-3)


def test_shapes_outside_the_image_leave_paper():
    grey = paint_target(PLAIN, in_front(0.5, 0.0, 0.2), Drawing(DISCS, SQUARES))
    assert grey == pytest.approx(np.full((100, 120), Appearance().paper))


def test_disc_smaller_than_a_pixel_keeps_its_light():
    coverage = darkness(PLAIN, in_front(0.0, 0.0, 0.2), [0.0, 0.0, 0.0], 0.0003, 0.7)
    assert coverage.sum() == pytest.approx(math.pi * 0.75**2, rel=0.01)


@pytest.mark.parametrize("blur", [0.0, 0.7])
def test_shapes_that_touch_leave_no_seam(blur):
    look = Appearance(blur_px=blur)
    middle = np.array([[-9, -9, 1.7, 0.4], [1.7, -9, 9, 0.4], [-9, 0.4, 1.7, 9], [1.7, 0.4, 9, 9]])
    pose = TILTED @ in_front(0.003, 0.001, 0.0)
    parts = Drawing(rectangles=middle / 1000)
    whole = Drawing(rectangles=np.array([[-9, -9, 9, 9]]) / 1000)
    together, one = (paint_target(SMALL, pose, each, appearance=look) for each in (parts, whole))
    assert one.min() == pytest.approx(look.ink, abs=1e-3)
    np.testing.assert_allclose(together, one, atol=1e-9)


def test_surroundings_end_at_the_plate():
    grain = np.random.default_rng(1).uniform(20.0, 90.0, (100, 120))
    pose = in_front(0.0, 0.0, 0.2)
    painted = paint_target(PLAIN, pose, PLATE, surroundings=grain)
    plate = paint_target(PLAIN, pose, PLATE, appearance=Appearance(background=0.0))
    np.testing.assert_array_equal(painted[plate == 0.0], grain[plate == 0.0])
    shared = (plate > 0.0) & (grain < plate)
    assert np.all(painted[shared] <= plate[shared] + grain[shared])
    inside = np.s_[45:55, 55:65]
    np.testing.assert_allclose(painted[inside], plate[inside], atol=1e-3)


def test_light_falls_off_linearly():
    look = Appearance(gradient=(0.2, -0.1))
    nothing = paint_target(PLAIN, in_front(0.5, 0.0, 0.2), Drawing(DISCS), appearance=look)
    assert nothing[0, 0] == pytest.approx(look.paper * 0.95)
    assert nothing[0, -1] == pytest.approx(look.paper * 1.15)
    assert nothing[-1, 0] == pytest.approx(look.paper * 0.85)
    assert np.ptp(np.diff(nothing, axis=1)) == pytest.approx(0.0, abs=1e-9)


def test_noise_has_its_level_and_its_seed():
    look = Appearance(noise=3.0)
    pose = in_front(0.0, 0.0, 0.2)

    def drawn(seed):
        rng = None if seed is None else np.random.default_rng(seed)
        return render_target(PLAIN, pose, PLATE, appearance=look, rng=rng).astype(float)

    clean = paint_target(PLAIN, pose, PLATE, appearance=look)
    assert np.abs(drawn(None) - clean).max() <= 0.5
    # 12000 pixels know their spread to 1 / sqrt(24000); rounding adds 1/12 to the variance.
    spread = np.std(drawn(5) - clean)
    assert spread == pytest.approx(math.sqrt(9 + 1 / 12), rel=4 / math.sqrt(24000))
    assert np.array_equal(drawn(5), drawn(5))
    assert not np.array_equal(drawn(5), drawn(6))


def test_grey_levels_are_clipped_to_eight_bits():
    look = Appearance(paper=300.0, ink=-40.0, blur_px=0.0)
    image = render_target(PLAIN, in_front(0.0, 0.0, 0.2), Drawing(DISCS), appearance=look)
    assert image.dtype == np.uint8
    assert (image.min(), image.max()) == (0, 255)


def test_other_camera_models_draw_too():
    fisheye = replace(PLAIN, model="equidistant", distortion=(0.02, -0.01, 0.0, 0.0))
    coverage = darkness(fisheye, in_front(0.0, 0.0, 0.2), [0.0, 0.0, 0.0], 0.004, 0.7)
    # On the axis the image is the angle itself; theta = 0.02 leaves theta^2 / 3 of difference.
    assert coverage.sum() == pytest.approx(math.pi * 10.0**2, rel=1e-3)


@pytest.mark.parametrize(
    "drawing",
    [
        Drawing(discs=np.array([[0.1, 0.0, 0.01]])),
        Drawing(rectangles=np.array([[0.09, -0.01, 0.11, 0.01]])),
    ],
)
def test_shape_behind_the_camera_is_refused_with_its_depth(drawing):
    pose = se3.from_parts(rotations.exp(np.array([0.0, 1.2, 0.0])), np.array([0.0, 0.0, 0.01]))
    depth = 0.01 - 0.11 * math.sin(1.2)
    with pytest.raises(UsageError, match=f"found a part {-1e3 * depth:.4g}"):
        paint_target(PLAIN, pose, drawing)
