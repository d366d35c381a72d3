"""What other methods say, as it stands in the document of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.records import Comparison

_KEYS = {
    "rotation": "rotation_mrad",
    "translation": "translation_mm",
    "predicted_rotation": "predicted_rotation_mrad",
    "predicted_translation": "predicted_translation_mm",
    "held_out_rotation": "held_out_rotation_mrad",
    "held_out_translation": "held_out_translation_mm",
}


def comparison_from_data(data: list[dict[str, Any]]) -> tuple[Comparison, ...]:
    """Return the rows of a `comparison:` list."""
    return tuple(
        Comparison(
            method=row["method"],
            reason=row.get("reason"),
            **{name: parts.optional_from_milli(row, key) for name, key in _KEYS.items()},
        )
        for row in data
    )


def data_from_comparison(rows: Sequence[Comparison]) -> list[dict[str, Any]] | None:
    """Return rows as a `comparison:` list, or None when there are none."""
    return [
        parts.without_unknown(
            {
                "method": row.method,
                **{key: parts.optional_milli(getattr(row, name)) for name, key in _KEYS.items()},
                "reason": row.reason,
            }
        )
        for row in rows
    ] or None
