"""Features documents: target points found in the images, and the stations without any."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.line import data_from_line, line_fields
from handeye_cli.documents.place import Place
from handeye_cli.documents.station_parts import (
    data_from_observation,
    observation_from_data,
    shared_error_from_data,
    station_head,
    station_names,
    uncertain_robot_pose,
)
from handeye_cli.records import Features, Station


def record_from_data(data: dict[str, Any], context: Context) -> Features:
    """Return the features of a document.

    Raises:
        InputError: A pose is none, a name comes twice, or ids and pixels do not belong together.
    """
    place = context.place.key("stations")
    entries = data["stations"]
    stations = tuple(
        _station(entry, name, context, place.item(index).of_station(name))
        for index, (entry, name) in enumerate(
            zip(entries, station_names(entries, place), strict=True)
        )
    )
    return Features(
        stations=stations,
        target=parts.target_from_data(data["target"]),
        image_size=_image_size(data),
        **line_fields(data, context),
    )


def data_from_record(record: Features) -> dict[str, Any]:
    """Return the document of features."""
    entries = [_entry(station) for station in record.stations]
    data = data_from_line(record, "features", entries)
    if record.image_size is None:
        return data
    # before the stations, which are long
    return {"schema": data.pop("schema"), "image_size": list(record.image_size), **data}


def _image_size(data: dict[str, Any]) -> tuple[int, int] | None:
    if "image_size" not in data:
        return None
    width, height = data["image_size"]
    return int(width), int(height)


def _station(entry: dict[str, Any], name: str, context: Context, place: Place) -> Station:
    robot, written = uncertain_robot_pose(entry, context, place)
    return Station(
        name=name,
        base_T_gripper=robot.matrix,
        observation=observation_from_data(entry, place),
        reason=entry.get("reason"),
        written=written,
        robot_covariance=robot.covariance,
        shared_error=shared_error_from_data(entry, robot.matrix, context),
    )


def _entry(station: Station) -> dict[str, Any]:
    return parts.without_unknown(
        {
            **station_head(station),
            "found": station.observation is not None,
            "reason": station.reason,
            **data_from_observation(station.observation),
        }
    )
