"""Plan documents: stations to visit, and the pairs the closed form will use."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import data_from_matrix, pose_from_data, robot_pose_from_data
from handeye_cli.documents.schema import header
from handeye_cli.documents.station_parts import station_names
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.errors import InputError
from handeye_cli.records import FloatArray, Plan, PlannedStation
from handeye_cli.records.planning import CircleError, Gain, MovedStation, PlanBasis


def record_from_data(data: dict[str, Any], context: Context) -> Plan:
    """Return the plan of a document.

    Raises:
        InputError: A pose is none or has a covariance, a name comes twice, a pair is not one of
            its stations, or the order does not visit all of them.
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
        basis=_basis(data.get("basis")),
        circle=_circle(data.get("circle")),
        moved=tuple(_moved(entry) for entry in data.get("moved", ())),
        gains=tuple(_gain(entry) for entry in data.get("gains", ())),
        order=_order(data, names, context.place),
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
            "basis": _data_from_basis(record.basis),
            "circle": _data_from_circle(record.circle),
            "moved": [_data_from_moved(each) for each in record.moved] or None,
            "gains": [_data_from_gain(each) for each in record.gains] or None,
            "order": list(record.order) or None,
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
        base_T_gripper=_robot_pose(entry, context, place),
        purpose=entry.get("purpose", "calibrate"),
    )


def _robot_pose(entry: dict[str, Any], context: Context, place: Place) -> FloatArray | None:
    key = "base_T_gripper"
    return robot_pose_from_data(entry[key], context.poses, place.key(key)) if key in entry else None


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


def _order(data: dict[str, Any], names: list[str], place: Place) -> tuple[str, ...]:
    order = tuple(str(name) for name in data.get("order", ()))
    if order and sorted(order) != sorted(names):
        raise InputError(
            f"expected each of the stations {', '.join(names)} once, found {', '.join(order)}",
            where=str(place.key("order")),
        )
    return order


def _basis(data: dict[str, Any] | None) -> PlanBasis | None:
    if data is None:
        return None
    lever = parts.optional_from_milli(data, "lever_mm")
    return PlanBasis(data["robot"], data["camera"], data["mount"], lever)


def _data_from_basis(basis: PlanBasis | None) -> dict[str, Any] | None:
    if basis is None:
        return None
    return parts.without_unknown(
        {
            "robot": basis.robot,
            "camera": basis.camera,
            "mount": basis.mount,
            "lever_mm": parts.optional_milli(basis.lever),
        }
    )


def _circle(data: dict[str, Any] | None) -> CircleError | None:
    if data is None:
        return None
    return CircleError(
        from_milli(data["rotation_mrad"]), from_milli(data["translation_mm"]), data["allowed"]
    )


def _data_from_circle(circle: CircleError | None) -> dict[str, Any] | None:
    if circle is None:
        return None
    return {
        "rotation_mrad": to_milli(circle.rotation),
        "translation_mm": to_milli(circle.translation),
        "allowed": circle.allowed,
    }


def _moved(data: dict[str, Any]) -> MovedStation:
    return MovedStation(
        str(data["name"]),
        tuple(data["limits"]),
        from_milli(data["rotation_mrad"]),
        from_milli(data["translation_mm"]),
    )


def _data_from_moved(moved: MovedStation) -> dict[str, Any]:
    return {
        "name": moved.name,
        "limits": list(moved.limits),
        "rotation_mrad": to_milli(moved.rotation),
        "translation_mm": to_milli(moved.translation),
    }


_GAIN_KEYS = {
    "rotation_before_mrad": "rotation_before",
    "translation_before_mm": "translation_before",
    "rotation_mrad": "rotation",
    "translation_mm": "translation",
}


def _gain(data: dict[str, Any]) -> Gain:
    levels = {name: from_milli(data[key]) for key, name in _GAIN_KEYS.items()}
    return Gain(str(data["name"]), **levels)


def _data_from_gain(gain: Gain) -> dict[str, Any]:
    levels = {key: to_milli(getattr(gain, name)) for key, name in _GAIN_KEYS.items()}
    return {"name": gain.name, **levels}
