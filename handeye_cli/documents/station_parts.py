"""What the stations of several kinds of document share: names, and what was seen of the target."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from handeye_cli.conventions import RobotPoses
from handeye_cli.documents.context import Context
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import (
    data_from_matrix,
    data_from_pose,
    robot_pose_from_data,
    uncertain_robot_pose_from_data,
)
from handeye_cli.documents.written import data_from_written, written_from_data
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.records import FloatArray, Observation, RecordedStation, Station, UncertainPose
from handeye_cli.records.line import WrittenRotation


def station_names(
    stations: Sequence[dict[str, Any]], place: Place, defaults: Sequence[str] | None = None
) -> list[str]:
    """Return the stations' names; one without a name is called by its default or its index.

    Args:
        stations: The entries of a list of stations.
        place: Where the list stands.
        defaults: Names for entries without one; their index as two digits when None.

    Raises:
        InputError: Two stations have the same name.
    """
    defaults = defaults or [f"{index:02d}" for index in range(len(stations))]
    names = [
        str(station.get("name", default))
        for station, default in zip(stations, defaults, strict=True)
    ]
    first: dict[str, int] = {}
    for index, name in enumerate(names):
        if first.setdefault(name, index) != index:
            raise InputError(
                f"expected every station to have a name of its own, found {name!r} "
                f"at {first[name]} and at {index}",
                where=str(place.item(index)),
                hint="give each of them a name: of its own",
            )
    return names


def robot_pose(
    station: dict[str, Any], context: Context, place: Place
) -> tuple[FloatArray, WrittenRotation | None]:
    """Return the (4, 4) `base_T_gripper` of a station's entry, and how it was written.

    Raises:
        InputError: It is no pose, has a covariance, or is not what `written` says it was.
    """
    key = "base_T_gripper"
    pose = robot_pose_from_data(station[key], context.poses, place.key(key))
    return pose, written_from_data(station, pose, context.poses, place)


def uncertain_robot_pose(
    station: dict[str, Any], context: Context, place: Place
) -> tuple[UncertainPose, WrittenRotation | None]:
    """Return the same of an entry whose pose may have a covariance beside the robot's noise.

    Raises:
        InputError: It is no pose or covariance, or is not what `written` says it was.
    """
    key = "base_T_gripper"
    pose = uncertain_robot_pose_from_data(station[key], context.poses, place.key(key))
    return pose, written_from_data(station, pose.matrix, context.poses, place)


def shared_error_from_data(
    station: dict[str, Any], base_T_gripper: FloatArray, context: Context
) -> FloatArray | None:
    """Return the (6,) error of `base_T_gripper` that all stations share, or None.

    Args:
        station: The station's entry, which has it for the robot's pose as it is written.
        base_T_gripper: (4, 4) the pose.
        context: How the document writes poses.
    """
    if "shared_error" not in station:
        return None
    conventions = context.poses
    error = np.array(station["shared_error"], dtype=float)
    error[:3] *= conventions.units.metres
    if conventions.robot_poses is not RobotPoses.BASE_IN_GRIPPER:
        return error
    return np.asarray(se3.inverse_jacobian(se3.inverse(base_T_gripper)) @ error)


def observation_from_data(station: dict[str, Any], place: Place) -> Observation | None:
    """Return what a station's entry says was seen, or None when it has no pixels.

    Raises:
        InputError: There are not as many ids as pixels, or an id comes twice.
    """
    if "pixels" not in station:
        return None
    ids = np.array(station["ids"], dtype=np.int64)
    pixels = np.array(station["pixels"], dtype=float).reshape(-1, 2)
    if len(ids) != len(pixels):
        message = f"expected as many ids as pixels, found {len(ids)} ids, {len(pixels)} pixels"
        raise InputError(message, where=str(place.key("ids")))
    values, counts = np.unique(ids, return_counts=True)
    if np.any(counts > 1):
        message = f"expected every id once, found {values[counts > 1][0]} more than once"
        raise InputError(message, where=str(place.key("ids")))
    sigma = station.get("sigma_px")
    return Observation(ids, pixels, None if sigma is None else float(sigma))


def data_from_observation(observation: Observation | None) -> dict[str, Any]:
    """Return the keys ids, pixels and sigma_px, unknown ones as None."""
    if observation is None:
        return {}
    return {
        "sigma_px": observation.sigma_px,
        "ids": observation.ids.tolist(),
        "pixels": observation.pixels.tolist(),
    }


def robot_pose_data(station: RecordedStation | Station) -> dict[str, Any]:
    """Return the robot's pose and how it was written, None where that is the default."""
    return {
        "base_T_gripper": data_from_matrix(station.base_T_gripper),
        "written": data_from_written(station.written),
    }


def station_head(station: Station) -> dict[str, Any]:
    """Return the name and the robot's pose, which every entry of a station begins with."""
    pose, error = (
        UncertainPose(station.base_T_gripper, station.robot_covariance),
        station.shared_error,
    )
    return {
        "name": station.name,
        **robot_pose_data(station),
        "base_T_gripper": data_from_pose(pose),
        "shared_error": None if error is None else (error + 0.0).tolist(),
    }
