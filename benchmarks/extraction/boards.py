"""Points of the other targets: distance from the true ones and time, beside OpenCV's own."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from benchmarks.effort import Effort
from benchmarks.extraction.detection import camera_of
from benchmarks.processes import timed
from benchmarks.tables import Column, Table
from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.extent import middle_of
from handeye_cli.simulate.render import Appearance, render_target

SIZE = (1000, 800)
BOARDS = {
    "chessboard:9x6:10mm": 28.0,
    "chessboard:9x6:20mm": 56.0,
    "charuco:5x7:20mm:14mm:DICT_6X6_250": 60.0,
    "apriltag:36h11:48mm": 150.0,
    "aruco:DICT_5X5_100:40mm": 60.0,
    "apriltag-grid:36h11:4x3:30mm:10mm": 60.0,
}
"""Targets, and pixels of their last length but one: a square, or the side of a tag."""
HEADS = (
    Column("target"),
    Column("views", "d"),
    Column("found", "d"),
    Column("points", "d"),
    Column("detect [px]", ".4f"),
    Column("refine [px]", ".4f"),
    Column("sigma / RMS", ".2f"),
    Column("detect [ms]", ".1f"),
    Column("refine [ms]", ".1f"),
)
NOTE = """Views of a bare board at tilts of 0 to 55 deg, blur 0.7 px, noise of 2 grey levels.
`detect` is what the search gives (OpenCV's, of tags and ChArUco boards), which is where the fit
starts; `refine` adds that fit through the camera. Both are RMS distances from the true points, per
coordinate."""


def look(camera, board, size_px, rng):
    """A picture of the board and the true pixels of its points."""
    points, length = board.points(), side_of(board)
    centre = middle_of(points)
    tilt, about = np.radians(rng.uniform(0, 55)), rng.uniform(0, 2 * np.pi)
    axis = np.array([np.cos(about), np.sin(about), 0.0])
    R = rotations.exp(tilt * axis) @ rotations.exp(np.array([0.0, 0.0, rng.uniform(-0.5, 0.5)]))
    pose = se3.from_parts(R, np.array([0.0, 0.0, camera.fx * length / size_px]) - R @ centre)
    image = render_target(camera, pose, board.drawing(), appearance=Appearance(noise=2.0), rng=rng)
    pixels = project(se3.transform_points(pose, points), camera.parameters, camera.model)
    return image, pixels


def side_of(board) -> float:
    return getattr(board, "square_mm", getattr(board, "size_mm", None)) / 1000


def run(text, size_px, count, seed):
    board, camera = targets.build(targets.parse(text)), camera_of(SIZE)
    rows = []
    for k in range(count):
        image, truth = look(camera, board, size_px, np.random.default_rng([seed, k]))
        rough, first = timed(board.detect, image)
        seen, second = timed(board.refine, image, rough, camera)
        if seen.reason is not None:
            continue
        turns = [truth[turn] for turn in board.turns()]
        best = min(turns, key=lambda turn: np.abs(turn[seen.ids] - seen.pixels).max())
        before, after = rough.pixels - best[rough.ids], seen.pixels - best[seen.ids]
        rows.append([np.mean(before**2), np.mean(after**2), seen.sigma_px or np.nan, first, second])
    return len(board.points()), np.array(rows)


def row(text, size_px, count, seed):
    points, table = run(text, size_px, count, seed)
    before, after, sigma, first, second = table.T
    ours = np.sqrt(np.mean(after))
    return (
        text,
        count,
        len(table),
        points,
        np.sqrt(np.mean(before)),
        ours,
        np.sqrt(np.mean(sigma**2)) / ours,
        1e3 * np.median(first),
        1e3 * np.median(second),
    )


def tables(effort: Effort) -> Iterator[Table]:
    cv2.setNumThreads(1)
    count = max(effort.views // 3, 3)
    rows = [row(text, size_px, count, effort.seed) for text, size_px in BOARDS.items()]
    yield Table("extraction_boards", "Points of other targets", HEADS, rows, NOTE)
