"""Where to send the robot: the paper's station generator, section IV-A1, for any setup."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import station_generator
from handeye_cli.geometry.star import star_pairs
from handeye_cli.records import FloatArray, Plan, PlannedStation

_MAX_TILT = math.radians(80.0)
"""Beyond it the plate is seen edge on."""


def plan(
    count: int,
    *,
    distance: float = 0.17,
    tilt: float = math.radians(30.0),
    setup: Setup = Setup.EYE_IN_HAND,
    centre: FloatArray | None = None,
    mount_T_camera: FloatArray | None = None,
    reference_T_target: FloatArray | None = None,
    verification: int = 0,
) -> Plan:
    """Place stations on the paper's circle and join them by the star drawing.

    Args:
        count: Number of stations to calibrate with, at least 3.
        distance: From the camera to the aim point, metres.
        tilt: Angle between the camera's axis and the plate's normal, radians, at most 80 degrees.
        setup: Where the camera is fixed.
        centre: (3,) aim point in the target frame, metres; the target's origin when None.
        mount_T_camera: (4, 4) guess of the answer; with `reference_T_target` it gives robot poses.
        reference_T_target: (4, 4) guess of where the target is fixed.
        verification: Number of stations to verify with, at most `count`, between the others.

    Returns:
        The stations, those to calibrate with first; the pairs are indices into these.

    Raises:
        UsageError: A number is out of its range, or only one of the two guesses is given.
    """
    _check_numbers(count, distance, tilt, verification)
    between = station_generator.between_angles(count, verification)
    directions = np.concatenate([station_generator.circle_angles(count), between])
    aim = np.zeros(3) if centre is None else np.asarray(centre, dtype=float)
    cameras = station_generator.tilted_stations(directions, distance, tilt, aim)
    robot = _robot_poses(cameras, mount_T_camera, reference_T_target, setup)
    stations = _stations(cameras, robot, count)
    return Plan(setup, stations, tuple((int(i), int(j)) for i, j in star_pairs(count)))


def station_names(count: int) -> list[str]:
    """Return the names "00", "01", ... of stations, all of one width."""
    digits = max(2, len(str(count - 1)))
    return [f"{i:0{digits}d}" for i in range(count)]


def _stations(
    cameras: FloatArray, robot: FloatArray | None, calibrating: int
) -> tuple[PlannedStation, ...]:
    return tuple(
        PlannedStation(
            name=name,
            target_T_camera=cameras[i],
            base_T_gripper=None if robot is None else robot[i],
            purpose="calibrate" if i < calibrating else "verify",
        )
        for i, name in enumerate(station_names(len(cameras)))
    )


def _check_numbers(count: int, distance: float, tilt: float, verification: int) -> None:
    if count < 3:
        raise UsageError(
            f"expected at least 3 stations, found {count}",
            hint="two stations leave the answer undetermined (the paper's lemmas VII and IX)",
        )
    if not (math.isfinite(distance) and distance > 0.0):
        raise UsageError(
            f"expected a distance above 0 mm, found {1e3 * distance:g} mm",
            hint="measure from the lens to the aim point on the plate",
        )
    if not 0.0 < tilt <= _MAX_TILT:
        raise UsageError(
            f"expected a tilt above 0 and up to 80 deg, found {math.degrees(tilt):g} deg",
            hint="30deg keeps most plates in view",
        )
    if not 0 <= verification <= count:
        raise UsageError(
            f"expected 0 to {count} verification stations, found {verification}",
            hint="they lie half-way between the stations to calibrate with",
        )


def _robot_poses(
    target_T_camera: FloatArray,
    mount_T_camera: FloatArray | None,
    reference_T_target: FloatArray | None,
    setup: Setup,
) -> FloatArray | None:
    if mount_T_camera is None and reference_T_target is None:
        return None
    if mount_T_camera is None or reference_T_target is None:
        missing = setup.answer if mount_T_camera is None else setup.constant
        given = setup.constant if mount_T_camera is None else setup.answer
        raise UsageError(
            f"robot poses need guesses of {setup.answer} and {setup.constant}, found only {given}",
            hint=f"give {missing} too, for example both from an earlier calibration document",
        )
    return station_generator.robot_poses(target_T_camera, mount_T_camera, reference_T_target, setup)
