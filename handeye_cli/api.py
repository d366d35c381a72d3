"""The project from Python: poses as arrays in, calibrations and verifications out.

Stations are given as two arrays of 4x4 transforms, `base_T_gripper` from the robot's controller and
`camera_T_target` from the images, in metres. `A_T_B` is the pose of B in A.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye_cli import solvers
from handeye_cli.conventions import Setup
from handeye_cli.documents.covariances import covariance_from_data
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError, UsageError, did_you_mean
from handeye_cli.estimation import choose_pairs
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.leave_one_out import leave_one_out as check_each
from handeye_cli.records import (
    Calibration,
    FloatArray,
    Noise,
    Station,
    Stations,
    UncertainPose,
    Verification,
)
from handeye_cli.solve import solve
from handeye_cli.solvers import Problem
from handeye_cli.verify import verify, verify_calibration

_NEAR_ROTATION = 1e-3
"""Largest departure of an element of `R R'` from the identity that is put down to rounding."""
_FEWEST = 3
_ROUNDING = 1e-12
"""Difference of two correlations that should be one, up to which it is rounding."""


@dataclass(frozen=True)
class Answers:
    """What one method answers for many recordings.

    Attributes:
        mount_T_camera: (..., 4, 4) `gripper_T_camera`, or `base_T_camera` for eye-to-hand.
        reference_T_target: (..., 4, 4) `base_T_target`, or `gripper_T_target` for eye-to-hand.
        converged: Whether every one of them settled; closed forms always do.
    """

    mount_T_camera: FloatArray
    reference_T_target: FloatArray
    converged: bool


def solve_poses(
    base_T_gripper: ArrayLike,
    camera_T_target: ArrayLike,
    *,
    setup: Setup | str = Setup.EYE_IN_HAND,
    method: str = solvers.DEFAULT,
    pairs: str = "star",
    camera_covariance: ArrayLike | None = None,
    noise: Noise | None = None,
    names: Sequence[str] | None = None,
) -> Calibration:
    """Compute where the camera sits, and how sure that is, as `handeye solve` does.

    Args:
        base_T_gripper: (N, 4, 4) poses of the robot, N at least 3.
        camera_T_target: (N, 4, 4) poses of the target.
        setup: `eye-in-hand` or `eye-to-hand`.
        method: Such as `maximum-likelihood` or `tsai-lenz`.
        pairs: Interstation pairs of the closed forms, `star` or `all`.
        camera_covariance: (N, 6, 6) of camera_T_target in the order x, y, z, rx, ry, rz, of a
            perturbation in the camera's frame; unknown when None.
        noise: Levels that are known; what is None in it is estimated.
        names: Names of the stations; `0`, `1`, ... when None.

    Raises:
        InputError: The arrays are no poses, or do not belong together.
        UsageError: Unknown setup, method or pairs.
        UndeterminedError: The stations do not determine the answer, or contradict each other.
        ConvergenceError: The estimation did not settle.
    """
    stations = _stations(
        base_T_gripper,
        camera_T_target,
        setup=setup,
        camera_covariance=camera_covariance,
        noise=noise,
        names=names,
    )
    return solve(stations, method=method, pairs=pairs)


def verify_poses(
    base_T_gripper: ArrayLike,
    camera_T_target: ArrayLike,
    *,
    calibration: Calibration | None = None,
    counts: Sequence[int] | None = None,
    leave_one_out: bool = False,
    target_moved: bool = False,
    setup: Setup | str = Setup.EYE_IN_HAND,
    method: str = solvers.DEFAULT,
    pairs: str = "star",
    camera_covariance: ArrayLike | None = None,
    noise: Noise | None = None,
    names: Sequence[str] | None = None,
) -> Verification:
    """Measure the error on stations that took no part in a calibration, as `handeye verify` does.

    The other arguments and errors are those of `solve_poses`.

    Args:
        base_T_gripper: (N, 4, 4) poses of the robot.
        camera_T_target: (N, 4, 4) poses of the target.
        calibration: An answer from other stations, to be checked on all of these.
        counts: Without a calibration, for each n of these: calibrate on the first n stations and
            verify on the next n. Half of the stations when None.
        leave_one_out: Instead, predict each station by a calibration on all others.
        target_moved: Whether the target has another place than during the calibration; at each
            station it then is where the other stations see it.
        setup: `eye-in-hand` or `eye-to-hand`; a calibration's own has to be the same.
        method: Such as `maximum-likelihood` or `tsai-lenz`.
        pairs: `star` or `all`.
        camera_covariance: (N, 6, 6) of camera_T_target, or None.
        noise: Levels that are known.
        names: Names of the stations.

    Raises:
        UsageError: The arguments exclude each other, or a count is out of range.
    """
    if sum((calibration is not None, counts is not None, leave_one_out)) > 1:
        raise UsageError("expected only one of calibration, counts and leave_one_out, found more")
    if target_moved and calibration is None:
        raise UsageError(
            "expected a calibration with target_moved, found none",
            hint="only a calibration made before can be older than the target's place",
        )
    stations = _stations(
        base_T_gripper,
        camera_T_target,
        setup=setup,
        camera_covariance=camera_covariance,
        noise=noise,
        names=names,
    )
    if calibration is not None:
        return verify_calibration(stations, calibration, target_moved=target_moved)
    if leave_one_out:
        return check_each(stations, method=method, pairs=pairs)
    return verify(stations, counts=counts, method=method, pairs=pairs)


def solve_batch(
    base_T_gripper: ArrayLike,
    camera_T_target: ArrayLike,
    *,
    setup: Setup | str = Setup.EYE_IN_HAND,
    method: str = solvers.DEFAULT,
    pairs: str = "star",
    camera_covariance: ArrayLike | None = None,
    noise: Noise | None = None,
) -> Answers:
    """Compute the answers of many recordings at once, as in a Monte Carlo study.

    Nothing is checked, estimated or predicted: what the noise is has to be given to
    `maximum-likelihood`, and whether a layout determines anything `solve_poses` tells.

    Args:
        base_T_gripper: (..., N, 4, 4) poses of the robot; the leading axes are the recordings.
        camera_T_target: (..., N, 4, 4) poses of the target; leading axes are broadcast.
        setup: `eye-in-hand` or `eye-to-hand`.
        method: Such as `maximum-likelihood` or `tsai-lenz`.
        pairs: `star` or `all`.
        camera_covariance: (N, 6, 6) of camera_T_target, the same in every recording.
        noise: The robot's levels and, without `camera_covariance`, the camera's; not used by closed
            forms.

    Raises:
        InputError: The arrays are no poses, or do not belong together.
        UsageError: Unknown setup, method or pairs, or levels of the noise are missing.
    """
    setup, solver = _setup(setup), solvers.load(method)
    robot, B = _paired(base_T_gripper, camera_T_target)
    count = robot.shape[-3]
    A = robot if setup is Setup.EYE_IN_HAND else se3.inverse(robot)
    covariance = np.broadcast_to(np.eye(12), (count, 12, 12))
    if method == solvers.MAXIMUM_LIKELIHOOD:
        of_camera = _covariances(camera_covariance, count)
        covariance = _joint_covariance(robot, setup, of_camera, noise or Noise())
    solution = solver.solve(Problem(A, B, choose_pairs(pairs, count), covariance))
    return Answers(solution.X, solution.Z, solution.converged)


def _joint_covariance(
    robot: FloatArray, setup: Setup, of_camera: FloatArray | None, noise: Noise
) -> FloatArray:
    """Return (N, 12, 12), or (..., N, 12, 12), of the perturbations of A_i and B_i."""
    by_robot = np.eye(6) if setup is Setup.EYE_IN_HAND else se3.inverse_jacobian(robot)
    of_robot = isotropic_covariance(*_levels(noise, "robot"))
    if of_camera is None:
        of_camera = isotropic_covariance(*_levels(noise, "camera"))
    upper = by_robot @ of_robot @ np.swapaxes(by_robot, -1, -2)
    batch = np.broadcast_shapes(upper.shape[:-2], of_camera.shape[:-2], robot.shape[-3:-2])
    joint = np.zeros((*batch, 12, 12))
    joint[..., :6, :6], joint[..., 6:, 6:] = upper, of_camera
    return joint


def _levels(noise: Noise, whose: str) -> tuple[float, float]:
    rotation, translation = (getattr(noise, f"{whose}_{of}") for of in ("rotation", "translation"))
    if not (rotation and translation):
        raise UsageError(
            f"expected the {whose}'s noise levels for {solvers.MAXIMUM_LIKELIHOOD}, found rotation "
            f"{rotation} and translation {translation}",
            hint=f"give noise=Noise({whose}_rotation=..., {whose}_translation=...), or a closed "
            "form as method",
        )
    return rotation, translation


def _setup(setup: Setup | str) -> Setup:
    known = [each.value for each in Setup]
    if setup not in known:
        near = did_you_mean(str(setup), known)
        raise UsageError(
            f"expected the setup {' or '.join(known)}, found {setup!r}",
            hint=f"did you mean {near}?" if near else None,
        )
    return Setup(setup)


def _stations(
    base_T_gripper: ArrayLike,
    camera_T_target: ArrayLike,
    *,
    setup: Setup | str,
    camera_covariance: ArrayLike | None,
    noise: Noise | None,
    names: Sequence[str] | None,
) -> Stations:
    setup = _setup(setup)
    robot, target = _paired(base_T_gripper, camera_T_target)
    if robot.ndim > 3:
        raise InputError(
            f"expected one recording, (N, 4, 4), found the shape {robot.shape}",
            hint="solve_batch takes leading axes",
        )
    count = len(robot)
    of_camera = _covariances(camera_covariance, count)
    names = [str(i) for i in range(count)] if names is None else list(names)
    if len(names) != count or len(set(names)) != count:
        raise InputError(f"expected {count} different names, found {names}", where="names")
    rows = tuple(
        Station(
            name=name,
            base_T_gripper=robot[i],
            camera_T_target=UncertainPose(target[i], None if of_camera is None else of_camera[i]),
        )
        for i, name in enumerate(names)
    )
    return Stations(setup, rows, noise=noise)


def _paired(base_T_gripper: ArrayLike, camera_T_target: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return both sides' poses, (..., N, 4, 4) with the same leading axes."""
    robot = _poses(base_T_gripper, "base_T_gripper")
    target = _poses(camera_T_target, "camera_T_target")
    try:
        batch = np.broadcast_shapes(robot.shape[:-3], target.shape[:-3])
    except ValueError:
        batch = None
    if batch is None or robot.shape[-3] != target.shape[-3]:
        raise InputError(
            "expected as many poses of the robot as of the target, found the shapes "
            f"{robot.shape} and {target.shape}"
        )
    return (
        np.broadcast_to(robot, (*batch, *robot.shape[-3:])),
        np.broadcast_to(target, (*batch, *target.shape[-3:])),
    )


def _poses(values: ArrayLike, name: str) -> FloatArray:
    poses = _numbers(values, name)
    if poses.ndim < 3 or poses.shape[-2:] != (4, 4) or poses.shape[-3] < _FEWEST:
        raise InputError(
            f"expected the shape (N, 4, 4) with N at least {_FEWEST}, found {poses.shape}",
            where=name,
        )
    R = poses[..., :3, :3]
    apart = np.max(np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)), axis=(-2, -1))
    below = np.max(np.abs(poses[..., 3, :] - [0.0, 0.0, 0.0, 1.0]), axis=-1)
    wrong = (apart > _NEAR_ROTATION) | (below > _NEAR_ROTATION) | (np.linalg.det(R) < 0.0)
    if wrong.any():
        worst = tuple(np.argwhere(wrong)[0].tolist())
        raise InputError(
            "expected rigid transforms, found one whose R R' departs from the identity by "
            f"{apart[worst]:.2g}, with the determinant {np.linalg.det(R[worst]):.3g} and the last "
            f"row {poses[worst][3].tolist()}",
            where=f"{name}{list(worst)}",
        )
    return se3.from_parts(rotations.project_to_so3(R), poses[..., :3, 3])


def _covariances(values: ArrayLike | None, count: int) -> FloatArray | None:
    if values is None:
        return None
    name = "camera_covariance"
    given = _numbers(values, name)
    if given.shape != (count, 6, 6):
        raise InputError(f"expected the shape ({count}, 6, 6), found {given.shape}", where=name)
    # Most are beyond doubt, and told so together; the rest is judged as in a document.
    for i in np.flatnonzero(_doubtful(given)):
        covariance_from_data(given[i].tolist(), 6, Place(f"{name}[{i}]"))
    return 0.5 * given + 0.5 * np.swapaxes(given, -1, -2)


def _doubtful(covariances: FloatArray) -> NDArray[np.bool_]:
    """Tell which of (N, 6, 6) matrices are not symmetric and positive definite to all digits."""
    sigma = np.sqrt(np.abs(np.einsum("nii->ni", covariances)))
    flat = np.any(sigma == 0.0, axis=-1)
    sigma = np.where(flat[:, None], 1.0, sigma)
    correlation = covariances / sigma[:, :, None] / sigma[:, None, :]
    crooked = np.abs(correlation - np.swapaxes(correlation, -1, -2)).max(axis=(-2, -1)) > _ROUNDING
    return np.asarray(flat | crooked | (np.linalg.eigvalsh(correlation)[:, 0] < 0.0))


def _numbers(values: ArrayLike, name: str) -> FloatArray:
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"expected an array of numbers, found {error}", where=name) from error
    if not np.all(np.isfinite(numbers)):
        first = np.argwhere(~np.isfinite(numbers))[0].tolist()
        found = numbers[tuple(first)]
        raise InputError(f"expected finite numbers, found {found}", where=f"{name}{first}")
    return numbers
