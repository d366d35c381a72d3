"""Truth documents: what a simulated recording was made from."""

from __future__ import annotations

from typing import Any

from handeye_cli.conventions import Setup
from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions, data_from_matrix, pose_from_data
from handeye_cli.documents.schema import header
from handeye_cli.documents.station_parts import station_names
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.errors import InputError
from handeye_cli.records import FloatArray
from handeye_cli.records.truth import TrueStation, Truth

_CONVENTIONS = PoseConventions()
"""A truth is written in the default conventions, and no flag changes it."""


def record_from_data(data: dict[str, Any], context: Context) -> Truth:
    """Return the truth of a document.

    Raises:
        InputError: Its poses are not those of its setup or have no rotation, or a name comes twice.
    """
    setup, noise = Setup(data["setup"]), data["noise"]
    keys = setup.answer, setup.constant
    answer, constant = (_constant(data, key, setup, context.place) for key in keys)
    return Truth(
        setup=setup,
        mount_T_camera=answer,
        reference_T_target=constant,
        stations=_stations(data["stations"], context.place.key("stations")),
        seed=int(data["seed"]),
        robot_rotation=from_milli(noise["robot_rotation_mrad"]),
        robot_translation=from_milli(noise["robot_translation_mm"]),
        image_noise=float(noise["image_grey_levels"]),
        blur_px=float(data["blur_px"]),
        faults=tuple(data.get("faults", ())),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def data_from_record(record: Truth) -> dict[str, Any]:
    """Return the document of a truth."""
    return parts.without_unknown(
        {
            "schema": header("truth"),
            "setup": str(record.setup),
            record.setup.answer: data_from_matrix(record.mount_T_camera),
            record.setup.constant: data_from_matrix(record.reference_T_target),
            "seed": record.seed,
            "noise": {
                "robot_rotation_mrad": to_milli(record.robot_rotation),
                "robot_translation_mm": to_milli(record.robot_translation),
                "image_grey_levels": record.image_noise,
            },
            "blur_px": record.blur_px,
            "faults": list(record.faults),
            "stations": [
                {
                    "name": station.name,
                    "base_T_gripper": data_from_matrix(station.base_T_gripper),
                    "camera_T_target": data_from_matrix(station.camera_T_target),
                }
                for station in record.stations
            ],
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _constant(data: dict[str, Any], key: str, setup: Setup, place: Place) -> FloatArray:
    if key not in data:
        found = ", ".join(name for name in data if "_T_" in name)
        raise InputError(
            f"expected the key {key!r} of the truth of an {setup} recording, found {found}",
            where=str(place),
        )
    return _pose(data, key, place)


def _pose(data: dict[str, Any], key: str, place: Place) -> FloatArray:
    return pose_from_data(data[key], _CONVENTIONS, place.key(key)).matrix


def _stations(entries: list[dict[str, Any]], place: Place) -> tuple[TrueStation, ...]:
    names = station_names(entries, place)
    places = [place.item(index).of_station(name) for index, name in enumerate(names)]
    return tuple(
        TrueStation(name, _pose(entry, "base_T_gripper", at), _pose(entry, "camera_T_target", at))
        for name, entry, at in zip(names, entries, places, strict=True)
    )
