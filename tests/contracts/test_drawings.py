"""A drawn target is the target: its own detector finds it where its points were drawn."""

import cv2
import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.drawing import Drawing

CAMERA = Camera(600, 450, 675.0, 673.5, 301.5, 222.75, (-0.15, 0.04, 5e-4, -5e-4, 0.0))
ACCURACY_PX = {
    "disc-grid": 0.02,
    "asymmetric-circles": 0.02,
    "chessboard": 0.1,
    "charuco": 0.15,
    "apriltag": 0.05,
    "aruco": 0.05,
    "apriltag-grid": 0.05,
    "aruco-grid": 0.05,
}
"""Largest RMS distance of the points from the true ones."""


@pytest.fixture(params=targets.TYPES)
def board(request):
    return targets.build(targets.parse(targets.board_class(request.param).EXAMPLE))


def before_the_camera(drawing: Drawing, tilt_deg: float, turn_deg: float) -> np.ndarray:
    """A pose at which the whole plate is in the image."""
    middle = np.append(drawing.outline.mean(axis=0), 0.0)
    diagonal = np.linalg.norm(np.ptp(drawing.outline, axis=0))
    tilt = rotations.exp(np.radians(tilt_deg) * np.array([0.6, 0.8, 0.0]))
    R = tilt @ rotations.exp(np.array([0.0, 0.0, np.radians(turn_deg)]))
    distance = 1.1 * CAMERA.fy * diagonal / CAMERA.height
    return se3.from_parts(R, np.array([0.0, 0.0, distance]) - R @ middle)


def test_a_drawn_target_is_found_where_its_points_are(board):
    # one kind of target almost from the front, the next one tilted, and so on
    tilt_deg, turn_deg = [(5.0, 8.0), (35.0, -20.0)][list(targets.TYPES).index(board.TYPE) % 2]
    pose = before_the_camera(board.drawing(), tilt_deg, turn_deg)
    light = Appearance(gradient=(0.1, -0.1), noise=2.0)
    rng = np.random.default_rng(3)
    grey = render_target(CAMERA, pose, board.drawing(), appearance=light, rng=rng)
    seen = board.refine(grey, board.detect(grey), CAMERA)
    assert seen.reason is None
    assert len(seen.ids) == len(board.points())
    truth = project(se3.transform_points(pose, board.points()), CAMERA.parameters, CAMERA.model)
    apart = [np.linalg.norm(seen.pixels - truth[turn][seen.ids], axis=1) for turn in board.turns()]
    assert min(np.sqrt(np.mean(each**2)) for each in apart) < ACCURACY_PX[board.TYPE]


def test_points_lie_on_the_plate_and_shapes_inside_of_it(board):
    drawing = board.drawing()
    first, last = drawing.outline
    assert np.all(first < last)
    spots = np.concatenate(
        [
            board.points()[:, :2],
            drawing.discs[:, :2] - drawing.discs[:, 2:],
            drawing.discs[:, :2] + drawing.discs[:, 2:],
            drawing.rectangles.reshape(-1, 2),
        ]
    )
    assert np.all((spots > first) & (spots < last))


def test_shapes_do_not_overlap(board):
    discs, rectangles = board.drawing().discs, board.drawing().rectangles
    apart = np.linalg.norm(discs[:, None, :2] - discs[None, :, :2], axis=-1)
    np.fill_diagonal(apart, np.inf)
    assert np.all(apart > discs[:, 2] + discs[:, None, 2])
    x0, y0, x1, y1 = rectangles.T
    width = np.minimum(x1[:, None], x1) - np.maximum(x0[:, None], x0)
    height = np.minimum(y1[:, None], y1) - np.maximum(y0[:, None], y0)
    shared = np.minimum(width, height)
    np.fill_diagonal(shared, -1.0)
    assert np.all(shared < 1e-12)
    assert np.all(x0 < x1)
    assert np.all(y0 < y1)


def raster(rectangles: np.ndarray, unit: float, columns: int, rows: int) -> np.ndarray:
    """A picture whose pixels are squares of this unit, black where there is a rectangle."""
    edges = rectangles / unit
    np.testing.assert_allclose(edges, np.rint(edges), atol=1e-9)
    image = np.full((rows, columns), 255, dtype=np.uint8)
    for x0, y0, x1, y1 in np.rint(edges).astype(int):
        image[y0:y1, x0:x1] = 0
    return image


@pytest.mark.parametrize("legacy", [None, False, True])
@pytest.mark.parametrize(("columns", "rows"), [(5, 7), (6, 5), (4, 6), (5, 4)])
@pytest.mark.parametrize("dictionary", ["DICT_4X4_50", "DICT_APRILTAG_16h5"])
def test_a_charuco_board_is_what_opencv_prints(columns, rows, legacy, dictionary):
    # 6 cells of 2 mm in squares of 20 mm: all edges lie on whole millimetres
    keys = f"charuco:{columns}x{rows}:20mm:12mm:{dictionary}"
    board = targets.build(targets.parse(keys + (":legacy" if legacy else "")))
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    theirs = cv2.aruco.CharucoBoard((columns, rows), 20.0, 12.0, known)
    theirs.setLegacyPattern(bool(legacy))
    printed = theirs.generateImage((20 * columns, 20 * rows))
    ours = raster(board.drawing().rectangles + 0.02, 1e-3, 20 * columns, 20 * rows)
    np.testing.assert_array_equal(ours, printed)


def test_an_aruco_grid_is_what_opencv_prints():
    board = targets.build(targets.parse("aruco-grid:DICT_4X4_50:3x2:12mm:3mm"))
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    theirs = cv2.aruco.GridBoard((3, 2), 12.0, 3.0, known)
    ours = raster(board.drawing().rectangles, 1e-3, 42, 27)
    np.testing.assert_array_equal(ours, theirs.generateImage((42, 27)))


def test_an_apriltag_is_drawn_upright_as_its_authors_print_it():
    board = targets.build(targets.parse("apriltag:36h11:8mm:id=0"))
    # tag 0 of the family, white is 1, as the project of the tags publishes it
    bits = np.array([int(bit) for bit in f"{0xD5D628584:036b}"], dtype=np.uint8).reshape(6, 6)
    ours = raster(board.drawing().rectangles, 1e-3, 8, 8)
    np.testing.assert_array_equal(ours, 255 * np.pad(bits, 1))


def test_every_tag_of_a_grid_stands_as_a_single_tag_does():
    grid = targets.build(targets.parse("apriltag-grid:36h11:3x1:8mm:2mm")).drawing().rectangles
    single = [
        targets.build(targets.parse(f"apriltag:36h11:8mm:id={tag}")).drawing().rectangles
        for tag in range(3)
    ]
    shifted = [each + 0.01 * tag * np.array([1, 0, 1, 0]) for tag, each in enumerate(single)]
    np.testing.assert_allclose(grid, np.concatenate(shifted), atol=1e-12)
