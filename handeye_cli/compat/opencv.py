"""OpenCV 4's two hand-eye functions, which OpenCV 5 no longer has.

    from handeye_cli.compat import opencv as cv2_handeye

    R, t = cv2_handeye.calibrateHandEye(R_gripper2base, t_gripper2base, R_target2cam, t_target2cam)

Names, arguments, accepted shapes and results are those of OpenCV 4.14, to within rounding, but:

- Where OpenCV cannot answer, these functions do. Its Andreff and Li methods need motions without a
  common fixed point. Its Tsai method needs an answer away from 180 degrees, and returns the
  identity when fewer than two motions are between 17 and 116 degrees. Its Park, Horaud and
  Daniilidis methods may fail with motions near 180 degrees. `estimators` has the details.
- Where it answers silently and wrongly, these raise: an unknown method, a number that is not
  finite, a matrix that is no rotation, motions about one axis only.
- Errors are `CalibrationError`: a `cv2.error` as well as a `HandeyeError`.

Lengths may have any unit, the same in all arguments; as in OpenCV, the answers of Andreff,
Daniilidis and Li depend on it within the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from handeye_cli.compat import estimators
from handeye_cli.compat.arguments import CalibrationError, FloatArray, deliver, read_poses

CALIB_HAND_EYE_TSAI = 0
CALIB_HAND_EYE_PARK = 1
CALIB_HAND_EYE_HORAUD = 2
CALIB_HAND_EYE_ANDREFF = 3
CALIB_HAND_EYE_DANIILIDIS = 4
CALIB_ROBOT_WORLD_HAND_EYE_SHAH = 0
CALIB_ROBOT_WORLD_HAND_EYE_LI = 1

Arrays = ArrayLike | Sequence[ArrayLike]
"""One array with a leading axis of stations, or a sequence of arrays."""

__all__ = [
    "CALIB_HAND_EYE_ANDREFF",
    "CALIB_HAND_EYE_DANIILIDIS",
    "CALIB_HAND_EYE_HORAUD",
    "CALIB_HAND_EYE_PARK",
    "CALIB_HAND_EYE_TSAI",
    "CALIB_ROBOT_WORLD_HAND_EYE_LI",
    "CALIB_ROBOT_WORLD_HAND_EYE_SHAH",
    "CalibrationError",
    "calibrateHandEye",
    "calibrateRobotWorldHandEye",
]


def calibrateHandEye(  # noqa: PLR0917 - OpenCV's own order of arguments
    R_gripper2base: Arrays,
    t_gripper2base: Arrays,
    R_target2cam: Arrays,
    t_target2cam: Arrays,
    R_cam2gripper: FloatArray | None = None,
    t_cam2gripper: FloatArray | None = None,
    method: int = CALIB_HAND_EYE_TSAI,
) -> tuple[FloatArray, FloatArray]:
    """Return the camera's pose in the gripper's frame, from at least three stations.

    Args:
        R_gripper2base: N rotations of the gripper in the base: (3, 3) matrices, or rotation vectors
            of three elements in radians.
        t_gripper2base: N translations of three elements.
        R_target2cam: N rotations of the target in the camera.
        t_target2cam: N translations.
        R_cam2gripper: (3, 3) float64 array to be filled, or None.
        t_cam2gripper: (3, 1) or (3,) float64 array to be filled, or None.
        method: One of the constants CALIB_HAND_EYE_*.

    Returns:
        R_cam2gripper (3, 3) and t_cam2gripper (3, 1), the given arrays where they fit.

    Raises:
        CalibrationError: The arguments are not valid, or do not determine the answer.
    """
    base_T_gripper = read_poses(R_gripper2base, t_gripper2base, "gripper2base")
    camera_T_target = read_poses(R_target2cam, t_target2cam, "target2cam")
    gripper_T_camera = estimators.hand_eye(base_T_gripper, camera_T_target, method)
    return deliver(gripper_T_camera, R_cam2gripper, t_cam2gripper)


def calibrateRobotWorldHandEye(  # noqa: PLR0917 - OpenCV's own order of arguments
    R_world2cam: Arrays,
    t_world2cam: Arrays,
    R_base2gripper: Arrays,
    t_base2gripper: Arrays,
    R_base2world: FloatArray | None = None,
    t_base2world: FloatArray | None = None,
    R_gripper2cam: FloatArray | None = None,
    t_gripper2cam: FloatArray | None = None,
    method: int = CALIB_ROBOT_WORLD_HAND_EYE_SHAH,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the base's pose in the world and the gripper's in the camera's frame.

    Args:
        R_world2cam: N rotations of the world (the target) in the camera: (3, 3) matrices, or
            rotation vectors of three elements in radians.
        t_world2cam: N translations of three elements.
        R_base2gripper: N rotations of the base in the gripper: the inverse of `R_gripper2base`.
        t_base2gripper: N translations.
        R_base2world: (3, 3) float64 array to be filled, or None.
        t_base2world: (3, 1) or (3,) float64 array to be filled, or None.
        R_gripper2cam: (3, 3) float64 array to be filled, or None.
        t_gripper2cam: (3, 1) or (3,) float64 array to be filled, or None.
        method: One of the constants CALIB_ROBOT_WORLD_HAND_EYE_*.

    Returns:
        R_base2world (3, 3), t_base2world (3, 1), R_gripper2cam (3, 3) and t_gripper2cam (3, 1), the
        given arrays where they fit.

    Raises:
        CalibrationError: The arguments are not valid, or do not determine the answer.
    """
    camera_T_world = read_poses(R_world2cam, t_world2cam, "world2cam")
    gripper_T_base = read_poses(R_base2gripper, t_base2gripper, "base2gripper")
    both = estimators.robot_world(camera_T_world, gripper_T_base, method)
    return (
        *deliver(both.X, R_base2world, t_base2world),
        *deliver(both.Z, R_gripper2cam, t_gripper2cam),
    )
