"""A poses-only document with a known answer, written without our own writer."""

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3, station_generator

TRUTH = se3.from_parts(rotations.exp(np.array([0.1, -0.2, 1.5])), np.array([0.05, -0.03, 0.12]))
BASE_T_TARGET = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.array([0.6, 0.1, 0.0]))
SIGMA_ROTATION, SIGMA_TRANSLATION = 2e-4, 1e-4  # of each pose, RMS magnitude, rad and m


def pose(matrix):
    """Return a pose as a document writes it."""
    quaternion = rotations.quaternion_from_matrix(matrix[:3, :3])
    return {"translation": matrix[:3, 3].tolist(), "quaternion": quaternion.tolist()}


def stations_document(count, seed=5):
    """Return a document of `count` noisy stations around `TRUTH`."""
    rng = np.random.default_rng(seed)
    cameras = station_generator.generate_stations(count, 0.3, np.radians(35))
    # at different distances, or a note would say that the target's size cannot be checked
    cameras[:, :3, 3] *= np.linspace(0.9, 1.1, count)[:, None]
    robot = station_generator.robot_poses(cameras, TRUTH, BASE_T_TARGET, Setup.EYE_IN_HAND)
    sigma = np.repeat([SIGMA_TRANSLATION, SIGMA_ROTATION], 3) / np.sqrt(3)
    robot = se3.perturb(robot, sigma * rng.standard_normal((count, 6)))
    seen = se3.perturb(se3.inverse(cameras), sigma * rng.standard_normal((count, 6)))
    return {
        "schema": "handeye/stations/1",
        "setup": "eye-in-hand",
        "stations": [
            {"name": f"{i:02d}", "base_T_gripper": pose(a), "camera_T_target": pose(b)}
            for i, (a, b) in enumerate(zip(robot, seen, strict=True))
        ],
    }
