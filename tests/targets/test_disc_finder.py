"""Grids of discs in random views, and the steps that find them one by one."""

import cv2
import numpy as np
import pytest
from targets.rendering import chessboard, discs, pose_view, project, render

from handeye_cli import targets
from handeye_cli.records import Camera
from handeye_cli.simulate.random_views import random_view
from handeye_cli.targets import disc_outlines
from handeye_cli.targets.disc_ladder import ladder, spots_of
from handeye_cli.targets.disc_lattice import grow
from handeye_cli.targets.disc_spots import Spots, _some, find_spots, moments

VGA = Camera(640, 480, 550.0, 550.0, 316.7, 242.1, (-0.2, 0.05, 0.0005, -0.0003, 0.0))
BENCH = Camera(640, 480, 550.4, 550.4, 316.7, 242.1, VGA.distortion)
LARGE = Camera(1600, 1200, 1376.0, 1376.0, 796.7, 602.1, VGA.distortion)


def board_of(text):
    board = targets.build(targets.parse(text))
    points = board.points()
    radii = np.full(len(points), board.diameter_mm / 2000)
    if getattr(board, "corner_diameter_mm", None):
        radii[0] = board.corner_diameter_mm / 2000
    return board, points, radii


def nearest_turn(board, detection, truth):
    """Largest distance to the truth, for the turn of the board that fits best."""
    assert detection.reason is None
    assert len(detection.ids) == len(truth)
    return min(
        np.linalg.norm(detection.pixels - truth[turn], axis=1).max() for turn in board.turns()
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "text",
    ["disc-grid:6x6:5mm:4mm", "disc-grid:7x5:5mm:2.5mm:4mm", "asymmetric-circles:4x7:3mm:3mm"],
)
def test_every_plate_is_found_in_random_light_and_clutter(text, seed):
    board, points, radii = board_of(text)
    view = random_view(VGA, points, radii, np.random.default_rng([5, seed]))
    assert nearest_turn(board, board.detect(view.image), view.ellipses) < 0.5


@pytest.mark.parametrize("seed", range(3))
def test_light_discs_on_dark_paper_are_found(seed):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    view = random_view(VGA, points, radii, np.random.default_rng([6, seed]))
    assert nearest_turn(board, board.detect(255 - view.image), view.ellipses) < 0.5


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "text", ["disc-grid:10x10:25.4mm:12.7mm:25.4mm", "asymmetric-circles:4x11:20mm:10mm"]
)
def test_plates_that_fill_a_distorted_image_are_found(text, seed):
    board, points, radii = board_of(text)
    rng = np.random.default_rng([8, seed])
    view = random_view(VGA, points, radii, rng, width_px=(14.0, 22.0))
    assert nearest_turn(board, board.detect(view.image), view.ellipses) < 0.5


def shaded(image, point, angle, share):
    """A shadow with a sharp edge through a point."""
    y, x = np.indices(image.shape)
    depth = (x - point[0]) * np.cos(angle) + (y - point[1]) * np.sin(angle)
    return np.rint(image * (1.0 - share * np.clip(depth + 0.5, 0.0, 1.0))).astype(np.uint8)


@pytest.mark.parametrize("share", [0.4, 0.7])
@pytest.mark.parametrize("seed", range(3))
def test_the_edge_of_a_shadow_across_the_plate_loses_no_disc(seed, share):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng([9, seed])
    view = random_view(VGA, points, radii, rng, width_px=(16.0, 40.0))
    through = view.ellipses[14] + rng.uniform(-5.0, 5.0, 2)
    image = shaded(view.image, through, rng.uniform(0.0, np.pi), share)
    # a start for the fit, which takes centres within 2 px
    assert nearest_turn(board, board.detect(image), view.ellipses) < 2.0


def motion(image):
    return cv2.blur(image, (5, 1))


def glare(image):
    return np.clip(2.0 * image, 0, 255).astype(np.uint8)


def defocus(image):
    return cv2.GaussianBlur(image, (0, 0), 2.0)


@pytest.mark.parametrize("spoil", [motion, glare, defocus, np.invert])
@pytest.mark.parametrize("seed", range(2))
def test_discs_are_found_in_spoilt_images(seed, spoil):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng([10, seed])
    view = random_view(VGA, points, radii, rng, width_px=(18.0, 50.0))
    assert nearest_turn(board, board.detect(spoil(view.image)), view.ellipses) < 0.6


@pytest.mark.parametrize("seed", [106, 114, 121, 125, 126, 131, 146])
def test_gaps_of_a_pixel_between_discs_are_open_in_an_enlarged_image(seed):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng([11, seed])
    tilt = (np.radians(50.0), np.radians(56.0))
    view = random_view(VGA, points, radii, rng, width_px=(8.5, 10.0), tilt=tilt)
    assert nearest_turn(board, board.detect(view.image), view.ellipses) < 0.6


@pytest.mark.parametrize("seed", [6, 44, 146])
def test_slim_discs_of_four_to_six_pixels_are_found(seed):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng([5, seed])
    tilt = (np.radians(40.0), np.radians(55.0))
    view = random_view(BENCH, points, radii, rng, width_px=(8.0, 12.0), tilt=tilt)
    assert view.width < 6.5
    assert nearest_turn(board, board.detect(view.image), view.ellipses) < 0.6


def test_slim_discs_with_dark_surroundings_are_found_in_a_large_image():
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    view = random_view(
        LARGE, points, radii, np.random.default_rng([1, 1600, 1]), width_px=(12.0, 150.0)
    )
    for image in (view.image, 255 - view.image):
        assert nearest_turn(board, board.detect(image), view.ellipses) < 0.5


def test_few_discs_are_not_made_of_clutter():
    """The steps for slim discs see a grid of nine where the plate is painted over."""
    _, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    view = random_view(BENCH, points, radii, np.random.default_rng([99, 37]))
    hull = cv2.convexHull(view.ellipses.astype(np.float32))
    patch = np.rint(hull.mean(axis=0) + 1.3 * (hull - hull.mean(axis=0))).astype(np.int32)
    image = cv2.fillConvexPoly(view.image.copy(), patch, int(np.median(view.image)))
    for declared in ("disc-grid:3x3:5mm:3mm", "disc-grid:6x6:5mm:4mm"):
        assert board_of(declared)[0].detect(image).reason is not None


def test_the_steps_for_slim_discs_do_not_change_the_reason():
    board, _, _ = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (240, 320), dtype=np.uint8), (0, 0), 1.5)
    told, untold = [], []
    for step in ladder(texture.shape):
        (told if step.telling else untold).append(len(spots_of(texture, step)))
    assert max(untold) > max(told)
    assert board.detect(texture).reason.startswith(f"{max(told)} spots like discs were found")


def test_steps_go_from_quick_and_likely_to_slow_and_no_two_are_alike():
    for size in [(480, 640), (1200, 1600), (1944, 2592), (3, 5), (1, 1)]:
        steps = ladder(size)
        assert len(set(steps)) == len(steps)
        assert {step.light for step in steps} == {False, True}
        assert not steps[0].smooth
        assert not steps[0].light
        assert max(size) / steps[0].factor <= 800
        assert (steps[-1].factor < 1) == (max(size) <= 1600)
        # what sees much clutter comes last, and what is enlarged last of its kind
        for group in (True, False):
            some = [step.factor < 1 for step in steps if step.telling == group and not step.light]
            assert some == sorted(some)
        assert [step.telling for step in steps] == sorted(
            (step.telling for step in steps), reverse=True
        )


@pytest.mark.parametrize("factor", [2, 3])
def test_large_images_are_searched_small_and_measured_at_full_size(factor):
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    view = random_view(VGA, points, radii, np.random.default_rng(7), width_px=(25.0, 40.0))
    large = cv2.resize(view.image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    truth = factor * view.ellipses + (factor - 1) / 2
    assert nearest_turn(board, board.detect(large), truth) < 0.15 * factor


def test_a_crop_says_where_the_plate_leaves_the_image():
    board, points, radii = board_of("disc-grid:6x6:5mm:4mm")
    view = random_view(
        VGA, points, radii, np.random.default_rng(3), width_px=(24.0, 26.0), tilt=(0.1, 0.4)
    )
    left, right = view.ellipses[:, 0].min(), view.ellipses[:, 0].max()
    for cut in np.linspace(left, right, 5)[1:3].astype(int).tolist():
        seen = board.detect(np.ascontiguousarray(view.image[:, cut:]))
        complete = np.sum(view.ellipses[:, 0] > cut + 0.5 * view.width + 1)
        assert "of 36 discs: the plate leaves the image on the left" in seen.reason
        assert abs(int(seen.reason.split()[0]) - complete) <= 2


@pytest.mark.parametrize(("shape", "declared"), [("7x6", "6x6"), ("6x7", "6x6"), ("8x8", "5x4")])
def test_a_larger_grid_than_declared_is_not_taken_for_it(shape, declared):
    board, _, _ = board_of(f"disc-grid:{declared}:5mm:3mm")
    _, points, _ = board_of(f"disc-grid:{shape}:5mm:3mm")
    H = pose_view(points.max(axis=0)[:2] * 1000, distance=80, tilt=20, roll=10)
    seen = board.detect(render(discs(points[:, :2] * 1000, 3.0), H))
    assert seen.reason == (
        f"the discs go on beyond {declared}: the declared grid fits several places"
    )


def test_the_squares_of_a_chessboard_are_no_discs():
    board, _, _ = board_of("disc-grid:6x6:5mm:4mm")
    # 36 dark squares lie on a lattice along its diagonals
    H = pose_view((11, 11), distance=30, tilt=10, roll=5)
    seen = board.detect(render(chessboard(10, 10, 1.0), H, samples=2))
    assert "no grid of 6x6 among them" in seen.reason


@pytest.mark.parametrize("width", [6.0, 5.0, 4.0, 3.5])
def test_discs_of_a_few_pixels_are_found(width):
    board, points, _ = board_of("disc-grid:6x6:5mm:4mm")
    H = pose_view((25, 25), distance=350 * 4 / width, tilt=10)
    seen = board.detect(render(discs(points[:, :2] * 1000, 4.0), H))
    assert nearest_turn(board, seen, project(H, points * 1000)) < 0.3


@pytest.mark.parametrize(("shift", "found"), [(0.02, True), (0.13, False)])
def test_discs_where_chance_put_them_are_no_grid(shift, found):
    board, points, _ = board_of("disc-grid:6x6:5mm:3mm")
    H = pose_view((25, 25), distance=60, tilt=20, roll=10)
    for seed in range(3):
        rng = np.random.default_rng([14, seed])
        moved = points[:, :2] * 1000 + 5.0 * rng.uniform(-shift, shift, (36, 2))
        seen = board.detect(render(discs(moved, 3.0), H, samples=2))
        assert (seen.reason is None) == found


@pytest.mark.parametrize("side", [2.5, 3.0])
def test_large_squares_are_no_discs(side):
    board, points, _ = board_of("disc-grid:4x3:5mm:3mm")
    H = pose_view((15, 10), distance=52, tilt=10, roll=10, focal=1100, centre=(320, 240))
    seen = board.detect(render(squares(points * 1000, side), H, size=(640, 480), samples=2))
    assert "their edges are not those of discs" in seen.reason


def squares(centres, side):
    """Dark squares at (n, 3) centres, with sides along the axes."""

    def colour(x, y):
        inside = np.zeros(x.shape, dtype=bool)
        for centre in centres:
            inside |= np.maximum(np.abs(x - centre[0]), np.abs(y - centre[1])) < side / 2
        return np.where(inside, 0.0, 1.0)

    return colour


def test_a_disc_that_is_missing_is_not_made_up():
    board, points, _ = board_of("disc-grid:6x6:5mm:3mm")
    H = pose_view((25, 25), distance=60, tilt=20, roll=10)
    keep = [k for k in range(36) if k != 14]
    seen = board.detect(render(discs(points[:, :2] * 1000, 3.0, keep=keep), H))
    assert seen.reason == "35 of 36 discs were found"


def test_what_hides_the_discs_is_said():
    board, points, _ = board_of("disc-grid:6x6:5mm:4mm")
    H = pose_view((25, 25), distance=60)
    sharp = render(discs(points[:, :2] * 1000, 4.0), H, samples=2)
    soft = cv2.GaussianBlur(sharp, (0, 0), 12.0)
    assert "the image is blurred, its sharpest edge is" in board.detect(soft).reason
    flat = np.full((240, 320), 99, dtype=np.uint8)
    assert board.detect(flat).reason == (
        "0 of 36 discs were found: the image has nothing but grey levels from 99 to 99"
    )


@pytest.mark.parametrize("shape", [(1, 1), (1, 400), (3, 5), (40, 2000)])
def test_images_of_any_shape_are_looked_at(shape):
    board, _, _ = board_of("disc-grid:6x6:5mm:4mm")
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, shape, dtype=np.uint8)
    reason = board.detect(image).reason
    assert "of 36 discs were found" in reason or "no grid of 6x6 among them" in reason


def test_moments_of_outlines_are_those_of_their_polygons_and_holes_turn_the_other_way():
    mask = np.zeros((80, 90), dtype=np.uint8)
    cv2.ellipse(mask, (40, 40), (30, 20), 25.0, 0.0, 360.0, 255, -1)
    cv2.circle(mask, (44, 42), 9, 0, -1)
    found, _ = cv2.findContoursLinkRuns(mask)
    area, centres, spread = moments(found)
    assert sorted(np.sign(area)) == [-1.0, 1.0]
    for k, each in enumerate(found):
        expected = cv2.moments(each)
        total = expected["m00"]
        assert abs(area[k]) == pytest.approx(total)
        np.testing.assert_allclose(centres[k], [expected["m10"] / total, expected["m01"] / total])
        second = [expected[name] / total for name in ("mu20", "mu11", "mu11", "mu02")]
        np.testing.assert_allclose(spread[k].ravel(), second, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("step", [1, 2, 3, 5, 20])
@pytest.mark.parametrize("shape", [(60, 120), (61, 77), (2, 300)])
def test_few_pixels_of_an_image_are_those_of_resizing(shape, step):
    image = np.random.default_rng(3).integers(0, 256, shape, dtype=np.uint8)
    size = tuple(max(1, side // step) for side in shape)
    np.testing.assert_array_equal(_some(image, step), cv2.resize(image, size[::-1]))


def ellipse_picture(centre, axes, angle):
    """An ellipse by counting: its middle, and the map from the unit circle."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shape = turn @ np.diag(axes)
    colour = discs([[0.0, 0.0]], 2.0)
    H = np.eye(3)
    H[:2, :2], H[:2, 2] = shape, centre
    return render(colour, H, size=(120, 100), noise=1.0), shape


@pytest.mark.parametrize(
    ("axes", "window", "depth"),
    [((6.0, 4.0), 23, 0.4), ((20.0, 9.0), 45, 0.2), ((30.0, 28.0), 161, 0.0)],
)
def test_a_spot_is_the_ellipse_that_was_drawn(axes, window, depth):
    image, _ = ellipse_picture((61.3, 47.8), axes, 0.7)
    spots = find_spots(image, window, depth)
    assert len(spots) == 1
    np.testing.assert_allclose(spots.centres[0], [61.3, 47.8], atol=0.2)
    # pixels are whole, and where dark begins depends on what is around
    np.testing.assert_allclose(np.linalg.svd(spots.shapes[0])[1], axes, atol=0.8)


def test_a_spot_in_an_enlarged_image_is_the_ellipse_that_was_drawn():
    image, shape = ellipse_picture((61.3, 47.8), (6.0, 4.0), 0.7)
    step = next(step for step in ladder(image.shape) if step.factor < 1)
    assert not step.light
    spots = spots_of(image, step)
    assert len(spots) == 1
    np.testing.assert_allclose(spots.centres[0], [61.3, 47.8], atol=0.15)
    np.testing.assert_allclose(np.linalg.svd(spots.shapes[0])[1], (6.0, 4.0), atol=0.5)
    # the long axis lies along that of the drawing
    along = np.linalg.svd(shape)[0][:, 0]
    assert abs(np.linalg.svd(spots.shapes[0])[0][:, 0] @ along) > 0.99


@pytest.mark.parametrize("axes", [(6.0, 4.0), (20.0, 9.0), (30.0, 28.0)])
def test_an_outline_is_measured_from_a_start_beside_it(axes):
    image, shape = ellipse_picture((61.3, 47.8), axes, 0.7)
    start = np.array([[61.3, 47.8]]) + 0.15 * axes[1]
    unknown = np.array([False])
    seen = disc_outlines.measure(image, start, 1.1 * shape[None], 3.0, known=unknown, doubt=2.5)
    assert seen.seen.tolist() == seen.sure.tolist() == seen.whole.tolist() == [True]
    np.testing.assert_allclose(seen.centres[0], [61.3, 47.8], atol=0.05)
    np.testing.assert_allclose(np.linalg.svd(seen.shapes[0])[1], axes, atol=0.25)


def test_discs_are_measured_alike_however_many_they_are():
    """More than 2047 do not fit into one of OpenCV's images of their rays."""
    image, shape = ellipse_picture((61.3, 47.8), (12.0, 9.0), 0.7)
    few, many = (
        disc_outlines.measure(
            image,
            np.tile([61.0, 48.0], (count, 1)),
            np.tile(shape, (count, 1, 1)),
            3.0,
            known=np.ones(count, dtype=bool),
            doubt=2.5,
        )
        for count in (1, 2048)
    )
    # sums in single precision depend on their order
    np.testing.assert_allclose(many.centres, np.tile(few.centres, (2048, 1)), rtol=1e-7)
    np.testing.assert_allclose(many.shapes, np.tile(few.shapes, (2048, 1, 1)), rtol=1e-7)
    assert np.all(many.sure)


def test_an_empty_place_is_no_disc():
    image, shape = ellipse_picture((61.3, 47.8), (12.0, 9.0), 0.7)
    places = np.array([[25.0, 25.0], [61.3, 47.8], [61.3, 62.0]])
    seen = disc_outlines.measure(
        image, places, np.stack([shape] * 3), 3.0, known=np.ones(3, dtype=bool), doubt=2.5
    )
    assert seen.seen.tolist() == [False, True, False]


@pytest.mark.parametrize("clutter", [30, 90], ids=["few", "many"])
@pytest.mark.parametrize("seed", range(4))
def test_a_lattice_grows_through_perspective_and_strays(seed, clutter):
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(48), 8)
    places = np.stack([column, row], axis=1)
    H = pose_view((7, 5), distance=12, tilt=55, about=rng.uniform(0, 360), roll=30 * seed)
    pixels = project(H, places)
    eps = 1e-4
    shapes = np.stack(
        [(project(H, places + step) - pixels) / eps for step in eps * np.eye(2)], axis=2
    )
    strays = rng.uniform(pixels.min(axis=0) - 60, pixels.max(axis=0) + 60, (clutter, 2))
    order = rng.permutation(48 + clutter)
    spots = Spots(
        np.concatenate([pixels + rng.normal(0, 0.2, pixels.shape), strays])[order],
        0.4 * shapes[np.arange(48 + clutter) % 48][order],
    )
    cells = next(grow(spots, 2.5, 1.0))
    found = {int(order[k]): place for k, place in zip(cells.members, cells.places, strict=True)}
    true = [k for k in range(48) if k in found]
    assert len(true) >= 46
    # whole-numbered, turned by quarters and shifted, never mirrored
    moved = np.array([found[k] for k in true])
    fit, *_ = np.linalg.lstsq(
        np.column_stack([places[true], np.ones(len(true))]), moved, rcond=None
    )
    np.testing.assert_allclose(fit[:2] @ fit[:2].T, np.eye(2), atol=1e-9)
    assert np.linalg.det(fit[:2]) == pytest.approx(1.0)


def test_a_part_that_may_be_enough_comes_before_spots_are_sought_beside_it():
    row, column = np.divmod(np.arange(20), 5)
    places = np.stack([column, row], axis=1)
    H = pose_view((4, 3), distance=12, tilt=30)
    pixels = project(H, places)
    sides = np.stack([project(H, places + step) - pixels for step in np.eye(2)], axis=2)
    # too small a spot sees no neighbours at its own scale: only its place on the lattice tells
    shapes = 0.4 * sides
    shapes[0] *= 0.7
    spots = Spots(pixels, shapes)
    first, last = grow(spots, 2.5, 1.0, enough=19)
    assert sorted(first.members) == list(range(1, 20))
    assert sorted(last.members) == list(range(20))
    assert (first.settled, last.settled) == (False, True)
    for cells in (first, last, *grow(spots, 2.5, 1.0)):
        seats = project(cells.homography, cells.places)
        np.testing.assert_allclose(seats, pixels[cells.members], atol=1e-3)
    assert len(list(grow(spots, 2.5, 1.0, enough=20))) == 1
