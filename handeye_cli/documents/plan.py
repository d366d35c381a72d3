"""Plan documents: stations to visit, and the pairs the closed form will use."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import data_from_matrix, pose_from_data
from handeye_cli.documents.schema import header
from handeye_cli.documents.station_parts import robot_pose, station_names
from handeye_cli.errors import InputError
from handeye_cli.records import Plan, PlannedStation


def record_from_data(data: dict[str, Any], context: Context) -> Plan:
    """Return the plan of a document.

    Raises:
        InputError: A pose is none or has a covariance, a name comes twice, or a pair is not one
            of its stations.
    """
    place = context.place.key("stations")
    entries = data["stations"]
    names = station_names(entries, place)
    stations = tuple(
        _station(entry, name, context, place.item(index).of_station(name))
        for index, (entry, name) in enumerate(zip(entries, names, strict=True))
    )
    prediction = data.get("predicted_error")
    return Plan(
        setup=context.setup,
        stations=stations,
        pairs=parts.pairs_from_data(data.get("pairs", []), len(stations), context.place),
        predicted_error=None if prediction is None else parts.predicted_error_from_data(prediction),
        noise=parts.noise_from_data(data.get("noise")),
        diagnosis=parts.findings_from_data(data.get("diagnosis", [])),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def data_from_record(record: Plan) -> dict[str, Any]:
    """Return the document of a plan."""
    return parts.without_unknown(
        {
            "schema": header("plan"),
            "setup": str(record.setup),
            "stations": [_entry(station) for station in record.stations],
            "pairs": parts.data_from_pairs(record.pairs),
            "predicted_error": parts.data_from_predicted_error(record.predicted_error),
            "noise": parts.data_from_noise(record.noise),
            "diagnosis": parts.data_from_findings(record.diagnosis),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _station(entry: dict[str, Any], name: str, context: Context, place: Place) -> PlannedStation:
    camera = place.key("target_T_camera")
    pose = pose_from_data(entry["target_T_camera"], context.poses, camera)
    if pose.covariance is not None:
        message = "expected a planned pose, which has no covariance, found one"
        raise InputError(message, where=str(camera.key("covariance")))
    return PlannedStation(
        name=name,
        target_T_camera=pose.matrix,
        base_T_gripper=robot_pose(entry, context, place) if "base_T_gripper" in entry else None,
        purpose=entry.get("purpose", "calibrate"),
    )


def _entry(station: PlannedStation) -> dict[str, Any]:
    robot = station.base_T_gripper
    return parts.without_unknown(
        {
            "name": station.name,
            "purpose": station.purpose,
            "target_T_camera": data_from_matrix(station.target_T_camera),
            "base_T_gripper": None if robot is None else data_from_matrix(robot),
        }
    )
