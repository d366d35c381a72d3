"""Pixels of plates that are not as declared, as stations documents."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pictures import WIDE, Shot, shoot

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import bundle, pnp
from handeye_cli.pixel_data import CALIBRATED
from handeye_cli.records import Camera, Finding, FloatArray, Stations, TargetSpec, UncertainPose
from handeye_cli.views import views_of

BOARD = TargetSpec("chessboard", {"rows": 5, "columns": 7, "square_mm": 40.0})
POINTS = targets.build(BOARD).points()
COUNT = 12
SIGMA = 0.1


def bent(height: float = 0.0, *, aspect: float = 0.0, shear: float = 0.0) -> FloatArray:
    """The board's points with a bow along x of this height, pitches apart, and corners askew."""
    x, y, _ = (POINTS - (POINTS.min(axis=0) + POINTS.max(axis=0)) / 2).T
    moved = POINTS + 0.5 * np.stack([aspect * x + shear * y, shear * x - aspect * y, 0 * x], axis=1)
    return moved + np.outer(height * (x / x.max()) ** 2, [0.0, 0.0, 1.0])


def photographed(
    rng: np.random.Generator,
    plate: FloatArray = POINTS,
    *,
    count: int = COUNT,
    sigma_px: float = SIGMA,
    tilt_deg: float = 30.0,
    robot: tuple[float, float] = (1e-3, 4e-4),
    setup: Setup = Setup.EYE_IN_HAND,
) -> Shot:
    """A recording of a plate that is declared as `BOARD`, from half a metre by a wide camera."""
    return shoot(
        rng,
        count,
        camera=WIDE,
        points=plate,
        spec=BOARD,
        distance=0.45,
        tilt_deg=tilt_deg,
        sigma_px=sigma_px,
        robot=robot,
        setup=setup,
    )


def stations_of(shot: Shot, camera: Camera = WIDE, *, calibrate: bool = False) -> Stations:
    """What the extrinsics make of a shot, started from the true poses to save time."""
    rows = shot.features.stations
    views = views_of(rows, POINTS)
    start, findings = shot.camera_T_target, ()
    if calibrate:
        found = bundle.calibrate(views.seen, camera.lens, start)
        variance = found.squares / views.degrees_of_freedom(9)
        fx, fy, cx, cy, *distortion = found.parameters.tolist()
        camera = Camera(camera.width, camera.height, fx, fy, cx, cy, tuple(distortion))
        camera = replace(camera, covariance=variance * np.linalg.inv(found.information))
        start, findings = found.poses, (Finding(CALIBRATED, "info", ""),)
    poses, squares = pnp.refine(start, views.seen, camera.lens)
    sigma = float(np.sqrt(np.sum(squares) / views.degrees_of_freedom()))
    covariance = sigma**2 * np.linalg.inv(pnp.pose_information(poses, views.seen, camera.lens))
    seen = tuple(
        replace(
            row,
            observation=replace(row.observation, sigma_px=sigma),
            camera_T_target=UncertainPose(pose, C),
        )
        for row, pose, C in zip(rows, poses, covariance, strict=True)
    )
    return Stations(shot.features.setup, seen, BOARD, camera, findings=findings)
