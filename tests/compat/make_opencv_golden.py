"""Write `opencv_golden.json`: what OpenCV 4's functions answer on noisy stations.

    python tests/compat/make_opencv_golden.py

needs an OpenCV that still has `calibrateHandEye` (4.x; the stored file is from 4.14.0) and `tests`
on the path as pytest has it (PYTHONPATH=tests). The stations are stored along with the answers, as
rotation vectors and translations, so that the test does not depend on how they were drawn.
"""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
from scenes import disturbed, general_scene, joint_covariance, scene

from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)
HAND_EYE = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
ROBOT_WORLD = ("SHAH", "LI")
FAIL_ON_PLANAR_AXES = {"ANDREFF", "LI"}
TARGET = Path(__file__).with_name("opencv_golden.json")


def station_lists(poses):
    return [rotations.log(poses[:, :3, :3]), poses[:, :3, 3]]


def stations(layout, seed, count):
    rng = np.random.default_rng(seed)
    perfect = layout(rng, count)
    joint = joint_covariance(count, NOISE)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    return A, disturbed(rng, perfect.B, joint[:, 6:, 6:])


def case(layout, seed, count):
    A, B = stations(layout, seed, count)
    left_out = FAIL_ON_PLANAR_AXES if layout is scene else set()
    robot, camera = station_lists(A), station_lists(B)
    hand_eye = {
        name: cv2.calibrateHandEye(*robot, *camera, method=getattr(cv2, f"CALIB_HAND_EYE_{name}"))
        for name in HAND_EYE
        if name not in left_out
    }
    inverse = station_lists(se3.inverse(A))
    robot_world = {
        name: cv2.calibrateRobotWorldHandEye(
            *camera, *inverse, method=getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}")
        )
        for name in ROBOT_WORLD
        if name not in left_out
    }
    return {
        "layout": layout.__name__,
        "gripper2base": [part.tolist() for part in robot],
        "target2cam": [part.tolist() for part in camera],
        "hand_eye": {name: [x.tolist() for x in found] for name, found in hand_eye.items()},
        "robot_world": {name: [x.tolist() for x in found] for name, found in robot_world.items()},
    }


if __name__ == "__main__":
    cases = [case(layout, 40 + n, n) for layout in (scene, general_scene) for n in (3, 5, 8)]
    document = {"opencv": cv2.__version__, "cases": cases}
    TARGET.write_text(json.dumps(document) + "\n", encoding="utf-8")
