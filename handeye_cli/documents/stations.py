"""Stations documents: robot poses and target poses, with the pixels they come from."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.line import data_from_line, line_fields, optional_target
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import data_from_pose, pose_from_data
from handeye_cli.documents.station_parts import (
    data_from_observation,
    observation_from_data,
    shared_error_from_data,
    station_head,
    station_names,
    uncertain_robot_pose,
)
from handeye_cli.records import Station, Stations


def record_from_data(data: dict[str, Any], context: Context) -> Stations:
    """Return the stations of a document.

    Raises:
        InputError: A pose or covariance is none, a name comes twice, or ids and pixels do not
            belong together.
    """
    place = context.place.key("stations")
    entries = data["stations"]
    stations = tuple(
        _station(entry, name, context, place.item(index).of_station(name))
        for index, (entry, name) in enumerate(
            zip(entries, station_names(entries, place), strict=True)
        )
    )
    return Stations(stations=stations, target=optional_target(data), **line_fields(data, context))


def data_from_record(record: Stations) -> dict[str, Any]:
    """Return the document of stations."""
    return data_from_line(record, "stations", [_entry(station) for station in record.stations])


def _station(entry: dict[str, Any], name: str, context: Context, place: Place) -> Station:
    key = "camera_T_target"
    pose = pose_from_data(entry[key], context.poses, place.key(key)) if key in entry else None
    robot, written = uncertain_robot_pose(entry, context, place)
    return Station(
        name=name,
        base_T_gripper=robot.matrix,
        observation=observation_from_data(entry, place),
        camera_T_target=pose,
        reason=entry.get("reason"),
        written=written,
        robot_covariance=robot.covariance,
        shared_error=shared_error_from_data(entry, robot.matrix, context),
    )


def _entry(station: Station) -> dict[str, Any]:
    pose = station.camera_T_target
    return parts.without_unknown(
        {
            **station_head(station),
            "camera_T_target": None if pose is None else data_from_pose(pose),
            "reason": station.reason,
            **data_from_observation(station.observation),
        }
    )
