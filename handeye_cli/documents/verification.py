"""Verification documents: held-out errors of a calibration, in rows as in the paper's table."""

from __future__ import annotations

from typing import Any

from handeye_cli.conventions import MIL
from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.place import Place
from handeye_cli.documents.schema import header
from handeye_cli.documents.station_parts import station_names
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.records import Protocol, StationError, Verification, VerificationRow


def record_from_data(data: dict[str, Any], context: Context) -> Verification:
    """Return the verification of a document.

    Raises:
        InputError: A name comes twice in one row.
    """
    place = context.place.key("rows")
    rows = enumerate(data["rows"])
    return Verification(
        setup=context.setup,
        method=data["method"],
        rows=tuple(_row(row, place.item(index)) for index, row in rows),
        diagnosis=parts.findings_from_data(data.get("diagnosis", [])),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
        protocol=Protocol(data.get("protocol", Protocol.SPLIT)),
    )


def data_from_record(record: Verification) -> dict[str, Any]:
    """Return the document of a verification."""
    return parts.without_unknown(
        {
            "schema": header("verification"),
            "setup": str(record.setup),
            "method": record.method,
            "protocol": str(record.protocol),
            "rows": [_row_entry(row) for row in record.rows],
            "diagnosis": parts.data_from_findings(record.diagnosis),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _row(row: dict[str, Any], place: Place) -> VerificationRow:
    entries = row.get("errors", [])
    names = station_names(entries, place.key("errors"))
    errors = tuple(
        StationError(
            name=name,
            rotation=from_milli(entry["rotation_mrad"]),
            translation=from_milli(entry["translation_mm"]),
            **_on_pixels(entry),
        )
        for name, entry in zip(names, entries, strict=True)
    )
    return VerificationRow(
        stations=int(row["stations"]),
        rotation=from_milli(row["rotation_mrad"]),
        translation=from_milli(row["translation_mm"]),
        predicted_rotation=parts.optional_from_milli(row, "predicted_rotation_mrad"),
        predicted_translation=parts.optional_from_milli(row, "predicted_translation_mm"),
        consistent=row.get("consistent"),
        errors=errors,
        **_on_pixels(row),
    )


def _on_pixels(entry: dict[str, Any]) -> dict[str, float | None]:
    """Return the errors that pixels tell of, of a row or of a station."""
    pixels = entry.get("reprojection_px")
    return {
        "reprojection": None if pixels is None else float(pixels),
        "plate": parts.optional_from_milli(entry, "plate_mm"),
    }


def _row_entry(row: VerificationRow) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "stations": row.stations,
            "rotation_mrad": to_milli(row.rotation),
            "translation_mm": to_milli(row.translation),
            "translation_mil": row.translation / MIL,
            "predicted_rotation_mrad": parts.optional_milli(row.predicted_rotation),
            "predicted_translation_mm": parts.optional_milli(row.predicted_translation),
            "reprojection_px": row.reprojection,
            "plate_mm": parts.optional_milli(row.plate),
            "consistent": row.consistent,
            "errors": [_error_entry(error) for error in row.errors],
        }
    )


def _error_entry(error: StationError) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "name": error.name,
            "rotation_mrad": to_milli(error.rotation),
            "translation_mm": to_milli(error.translation),
            "reprojection_px": error.reprojection,
            "plate_mm": parts.optional_milli(error.plate),
        }
    )
