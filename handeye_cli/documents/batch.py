"""Batch documents: what came of each of many recordings."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.schema import header
from handeye_cli.records.batch import Batch, BatchRow, BatchStatus

_PLAIN = ("sha256", "stations", "used", "consistent", "message", "advice", "calibration")


def record_from_data(data: dict[str, Any], _: Context) -> Batch:
    """Return the batch of a document."""
    return Batch(
        rows=tuple(_row(entry) for entry in data["rows"]),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def data_from_record(record: Batch) -> dict[str, Any]:
    """Return the document of a batch."""
    return parts.without_unknown(
        {
            "schema": header("batch"),
            "exit_code": record.exit_code,
            "rows": [_entry(row) for row in record.rows],
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _row(entry: dict[str, Any]) -> BatchRow:
    predicted, seen = entry.get("predicted_error", {}), entry.get("seen_error", {})
    return BatchRow(
        name=str(entry["name"]),
        status=BatchStatus(entry["status"]),
        exit_code=int(entry["exit_code"]),
        predicted_rotation=parts.optional_from_milli(predicted, "rotation_mrad"),
        predicted_translation=parts.optional_from_milli(predicted, "translation_mm"),
        seen_rotation=parts.optional_from_milli(seen, "rotation_mrad"),
        seen_translation=parts.optional_from_milli(seen, "translation_mm"),
        findings=tuple(entry.get("findings", ())),
        seconds=float(entry["seconds"]) if "seconds" in entry else None,
        **{key: entry.get(key) for key in _PLAIN},
    )


def _entry(row: BatchRow) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "name": row.name,
            "status": str(row.status),
            "exit_code": row.exit_code,
            "sha256": row.sha256,
            "stations": row.stations,
            "used": row.used,
            "predicted_error": _error(row.predicted_rotation, row.predicted_translation),
            "seen_error": _error(row.seen_rotation, row.seen_translation),
            "consistent": row.consistent,
            "findings": list(row.findings) or None,
            "message": row.message,
            "advice": row.advice,
            "calibration": row.calibration,
            "seconds": row.seconds,
        }
    )


def _error(rotation: float | None, translation: float | None) -> dict[str, Any] | None:
    """Return a pair of errors, or None where they are unknown."""
    error = {
        "rotation_mrad": parts.optional_milli(rotation),
        "translation_mm": parts.optional_milli(translation),
    }
    return parts.without_unknown(error) or None
