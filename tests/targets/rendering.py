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
    # single precision is a ten-thousandth of a pixel, and takes half the time
    back = np.linalg.inv(H).astype(np.float32)
    total = np.zeros((height, width), dtype=np.float32)
    u, v = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    middle = [row[0] * u + row[1] * v + row[2] for row in back]
    for cell in np.ndindex(samples, samples):
        # somewhere in each cell: a regular raster would move edges that run along it
        du, dv = (np.float32((k + rng.random(u.shape)) / samples - 0.5) for k in cell)
        x, y, w = (at + row[0] * du + row[1] * dv for at, row in zip(middle, back, strict=True))
        total += colour(x / w, y / w)
    image = 30 + 190 * total.astype(float) / samples**2
    image = cv2.GaussianBlur(image, (0, 0), blur)
    image += rng.normal(0.0, noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def discs(centres, diameters, *, dark=True, keep=None) -> Colour:
    """Discs at (n, 2) centres; `keep` leaves the others out."""
    centres = np.asarray(centres, dtype=np.float32)
    squares = np.broadcast_to(np.float32(diameters), len(centres)) ** 2 / 4
    shown = range(len(centres)) if keep is None else keep

    def colour(x, y):
        inside = np.zeros(x.shape, dtype=bool)
        for k in shown:
            inside |= (x - centres[k, 0]) ** 2 + (y - centres[k, 1]) ** 2 < squares[k]
        return inside != dark

    return colour


def chessboard(columns, rows, square, *, top_left_dark=True) -> Colour:
    """Inner corners from (0, 0) on; white around the squares."""

    def colour(x, y):
        i, j = np.floor(x / square), np.floor(y / square)
        board = (i >= -1) & (i < columns) & (j >= -1) & (j < rows)
        half = (i + j) / 2
        dark = (half == np.floor(half)) == top_left_dark
        return ~(board & dark)

    return colour


def bitmap(image, x0, y0, width, height, *, around=1.0) -> Colour:
    """An image whose outer edges lie at x0 to x0 + width and y0 to y0 + height."""
    rows, columns = image.shape
    levels = np.pad(np.float32(image) / np.float32(255), 1, constant_values=around)

    def colour(x, y):
        j = np.clip(np.floor((x - x0) * (columns / width)) + 1, 0, columns + 1)
        i = np.clip(np.floor((y - y0) * (rows / height)) + 1, 0, rows + 1)
        return levels[i.astype(np.int32), j.astype(np.int32)]

    return colour


def together(*colours) -> Colour:
    """Several dark things on one white ground."""
    return lambda x, y: np.minimum.reduce([each(x, y) for each in colours])
