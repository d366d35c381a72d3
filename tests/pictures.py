"""Pixels of target points seen by simulated stations, without drawing pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import camera as lens
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Features, FloatArray, Observation, Station, TargetSpec

CAMERA = Camera(640, 480, 1500.0, 1490.0, 322.0, 238.0, (-0.2, 0.05, 1e-3, -1e-3, 0.01))
WIDE = Camera(1280, 1024, 900.0, 905.0, 640.0, 500.0, (-0.25, 0.08, 5e-4, -5e-4, 0.0))
PLATE = TargetSpec("disc-grid", {"rows": 6, "columns": 6, "spacing_mm": 5.0, "diameter_mm": 4.0})


def grid(rows: int, columns: int, spacing: float) -> FloatArray:
    y, x = np.mgrid[:rows, :columns]
    return np.stack([x.ravel() * spacing, y.ravel() * spacing, np.zeros(x.size)], axis=1)


def quarter_turns(side: int) -> list[np.ndarray]:
    """Renumberings of a square grid that a plain detector may pick."""
    ids = np.arange(side * side).reshape(side, side)
    return [np.rot90(ids, k).ravel() for k in range(4)]


@dataclass(frozen=True)
class Shot:
    """Features with the truth they came from."""

    features: Features
    camera_T_target: FloatArray
    mount_T_camera: FloatArray


def shoot(
    rng: np.random.Generator,
    count: int,
    *,
    camera: Camera = CAMERA,
    points: FloatArray | None = None,
    spec: TargetSpec = PLATE,
    distance: float = 0.15,
    tilt_deg: float = 30.0,
    sigma_px: float = 0.05,
    setup: Setup = Setup.EYE_IN_HAND,
    robot: tuple[float, float] = (1e-3, 1e-4),
) -> Shot:
    points = grid(6, 6, 0.005) if points is None else points
    poses = se3.inverse(
        generate_stations(count, distance, np.radians(tilt_deg), points.mean(axis=0))
    )
    yaw = np.concatenate([np.zeros((count, 2)), rng.uniform(-np.pi, np.pi, (count, 1))], axis=1)
    poses = se3.from_parts(rotations.exp(yaw), np.zeros(3)) @ poses
    X = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.2 * rng.normal(size=3))
    Z = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.6 * rng.normal(size=3))
    A = Z @ se3.inverse(poses) @ se3.inverse(X)
    hand = A if setup is Setup.EYE_IN_HAND else se3.inverse(A)
    turn, shift = robot[0] / np.sqrt(3) * rng.normal(size=(count, 3)), robot[1] / np.sqrt(3)
    hand = se3.perturb(hand, np.concatenate([shift * rng.normal(size=(count, 3)), turn], axis=1))
    pixels = lens.project(se3.transform_points(poses, points), camera.parameters, camera.model)
    pixels = pixels + sigma_px * rng.normal(size=pixels.shape)
    rows = tuple(
        Station(f"{i:02d}", hand[i], Observation(np.arange(len(points)), pixels[i]))
        for i in range(count)
    )
    features = Features(setup, rows, spec, camera, (camera.width, camera.height))
    return Shot(features, poses, X)


def renumbered(features: Features, turns: list[np.ndarray], picks: np.ndarray) -> Features:
    """What a detector gives that numbers station i by turn picks[i]: pixel k is point turn[k]."""
    rows = []
    for station, pick in zip(features.stations, picks, strict=True):
        seen = station.observation
        assert seen is not None
        kept = replace(seen, pixels=seen.pixels[turns[pick]])
        rows.append(replace(station, observation=kept))
    return replace(features, stations=tuple(rows))
