"""What recording, features and stations documents have in common: all but their stations."""

from __future__ import annotations

from typing import Any, TypedDict

from handeye_cli.conventions import Setup
from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.schema import header
from handeye_cli.records import (
    Camera,
    Features,
    Finding,
    Noise,
    ProvenanceStep,
    Recording,
    Stations,
    TargetSpec,
)


class LineFields(TypedDict):
    """The fields that the three records share; see `handeye_cli.records`."""

    setup: Setup
    camera: Camera | None
    noise: Noise | None
    findings: tuple[Finding, ...]
    provenance: tuple[ProvenanceStep, ...]


def line_fields(data: dict[str, Any], context: Context) -> LineFields:
    """Return the shared fields of a document's record, its target excepted.

    Raises:
        InputError: The camera's covariance is none.
    """
    return LineFields(
        setup=context.setup,
        camera=parts.camera_from_data(data.get("camera"), context.place),
        noise=parts.noise_from_data(data.get("noise")),
        findings=parts.findings_from_data(data.get("findings", [])),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def optional_target(data: dict[str, Any]) -> TargetSpec | None:
    """Return the document's target, or None when it names none."""
    return parts.target_from_data(data["target"]) if "target" in data else None


def data_from_line(
    record: Recording | Features | Stations, kind: str, stations: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return the document of a record whose stations have been written already."""
    return parts.without_unknown(
        {
            "schema": header(kind),
            "setup": str(record.setup),
            "target": parts.data_from_target(record.target),
            "camera": parts.data_from_camera(record.camera),
            "noise": parts.data_from_noise(record.noise),
            "stations": stations,
            "findings": parts.data_from_findings(record.findings),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )
