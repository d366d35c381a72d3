"""Pictures of boards with known truth, drawn without the code under test.

Each pixel is the mean of the board's colour over samples inside of it, seen through a homography
from the board's plane (in any unit) to pixels; then blur, then noise.
"""

from collections.abc import Callable

import cv2
import numpy as np

Colour = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(x, y) in the board's plane to the share of white."""


def pose_view(
    unit_size, *, distance, tilt=0.0, about=0.0, roll=0.0, focal=350.0, centre=(160, 120)
):
    """The homography of a pinhole looking at the middle of a board; angles in degrees."""
    tilt, about, roll = np.radians([tilt, about, roll])
    axis = np.array([np.cos(about), np.sin(about), 0.0])
    R, _ = cv2.Rodrigues(tilt * axis)
    Rz, _ = cv2.Rodrigues(np.array([0.0, 0.0, roll]))
    R = R @ Rz
    middle = np.array([unit_size[0] / 2, unit_size[1] / 2, 0.0])
    t = np.array([0.0, 0.0, distance]) - R @ middle
    K = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    return K @ np.column_stack([R[:, 0], R[:, 1], t])


def project(H, points):
    seen = np.column_stack([points[:, :2], np.ones(len(points))]) @ H.T
    return seen[:, :2] / seen[:, 2:]


def render(colour, H, *, size=(320, 240), samples=4, blur=0.7, noise=2.0, seed=0):
    """A grey image of the board; black is 30 and white 220."""
    width, height = size
    rng = np.random.default_rng(seed)
    back = np.linalg.inv(H)
    total = np.zeros((height, width))
    u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    for cell in np.ndindex(samples, samples):
        # somewhere in each cell: a regular raster would move edges that run along it
        du, dv = ((part + rng.random(u.shape)) / samples - 0.5 for part in cell)
        x, y, w = (row[0] * (u + du) + row[1] * (v + dv) + row[2] for row in back)
        total += colour(x / w, y / w)
    image = 30 + 190 * total / samples**2
    image = cv2.GaussianBlur(image, (0, 0), blur)
    image += rng.normal(0.0, noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def discs(centres, diameters, *, dark=True, keep=None) -> Colour:
    """Discs at (n, 2) centres; `keep` leaves the others out."""
    centres = np.asarray(centres, dtype=float)
    diameters = np.broadcast_to(diameters, len(centres))
    shown = range(len(centres)) if keep is None else keep

    def colour(x, y):
        inside = np.zeros(x.shape, dtype=bool)
        for k in shown:
            inside |= (x - centres[k, 0]) ** 2 + (y - centres[k, 1]) ** 2 < diameters[k] ** 2 / 4
        return np.where(inside, 0.0, 1.0) if dark else np.where(inside, 1.0, 0.0)

    return colour


def chessboard(columns, rows, square, *, top_left_dark=True) -> Colour:
    """Inner corners from (0, 0) on; white around the squares."""

    def colour(x, y):
        i, j = np.floor(x / square).astype(int), np.floor(y / square).astype(int)
        board = (i >= -1) & (i < columns) & (j >= -1) & (j < rows)
        dark = ((i + j) % 2 == 0) == top_left_dark
        return np.where(board & dark, 0.0, 1.0)

    return colour


def bitmap(image, x0, y0, width, height, *, around=1.0) -> Colour:
    """An image whose outer edges lie at x0 to x0 + width and y0 to y0 + height."""
    rows, columns = image.shape

    def colour(x, y):
        j = np.floor((x - x0) / width * columns).astype(int)
        i = np.floor((y - y0) / height * rows).astype(int)
        inside = (i >= 0) & (i < rows) & (j >= 0) & (j < columns)
        levels = image[np.clip(i, 0, rows - 1), np.clip(j, 0, columns - 1)] / 255.0
        return np.where(inside, levels, around)

    return colour


def together(*colours) -> Colour:
    """Several dark things on one white ground."""
    return lambda x, y: np.minimum.reduce([each(x, y) for each in colours])
