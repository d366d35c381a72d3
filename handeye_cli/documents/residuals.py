"""The table of stations in documents: which were used, and how far each is from the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.place import Place
from handeye_cli.documents.station_parts import station_names
from handeye_cli.records import StationResidual


def residuals_from_data(data: list[dict[str, Any]], place: Place) -> tuple[StationResidual, ...]:
    """Return the rows of a `stations:` list.

    Args:
        data: The list.
        place: The document it stands in.

    Raises:
        InputError: Two stations have the same name.
    """
    names = station_names(data, place.key("stations"))
    return tuple(
        StationResidual(
            name=name,
            used=entry["used"],
            rotation=parts.optional_from_milli(entry, "rotation_residual_mrad"),
            translation=parts.optional_from_milli(entry, "translation_residual_mm"),
            reason=entry.get("reason"),
        )
        for name, entry in zip(names, data, strict=True)
    )


def data_from_residuals(stations: Sequence[StationResidual]) -> list[dict[str, Any]]:
    """Return rows as a `stations:` list."""
    return [
        parts.without_unknown(
            {
                "name": station.name,
                "used": station.used,
                "rotation_residual_mrad": parts.optional_milli(station.rotation),
                "translation_residual_mm": parts.optional_milli(station.translation),
                "reason": station.reason,
            }
        )
        for station in stations
    ]
