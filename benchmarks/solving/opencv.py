"""The hand-eye calibration of OpenCV 4; OpenCV 5 has none."""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.geometry import se3

_HAND_EYE = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
_ROBOT_WORLD = ("SHAH", "LI")
_HAS_ANY = hasattr(cv2, "calibrateHandEye")
HAND_EYE = _HAND_EYE if _HAS_ANY else ()
METHODS = (*_HAND_EYE, *_ROBOT_WORLD) if _HAS_ANY else ()
"""Methods there are in this OpenCV."""
REMARK = (
    ""
    if _HAS_ANY
    else f" OpenCV {cv2.__version__} has no hand-eye calibration; its rows need OpenCV 4."
)


def solve(name, A, B):
    """gripper_T_camera by one of OpenCV's methods, or None where it fails."""
    R, t = (lambda T: T[:, :3, :3]), (lambda T: T[:, :3, 3])
    try:
        if name in _HAND_EYE:
            method = getattr(cv2, f"CALIB_HAND_EYE_{name}")
            answer = cv2.calibrateHandEye(R(A), t(A), R(B), t(B), method=method)
            return se3.from_parts(answer[0], np.ravel(answer[1]))
        method = getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}")
        base = se3.inverse(A)
        answer = cv2.calibrateRobotWorldHandEye(R(B), t(B), R(base), t(base), method=method)
        return se3.inverse(se3.from_parts(answer[2], np.ravel(answer[3])))
    except cv2.error:
        return None
