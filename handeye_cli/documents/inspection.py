"""Inspection documents: what is right and what is wrong with the data."""

from __future__ import annotations

import math
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.free import data_from_free, free_from_data
from handeye_cli.documents.recording_summary import data_from_summary, summary_from_data
from handeye_cli.documents.residuals import data_from_residuals, residuals_from_data
from handeye_cli.documents.schema import header
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.records.blame import BlameShares, SmoothResiduals
from handeye_cli.records.hypotheses import HypothesisFit, LengthRatio
from handeye_cli.records.inspection import Inspection
from handeye_cli.records.moving import TimeOffset

_CAUSES = ("robot", "camera", "intrinsics", "plate", "timing")


def record_from_data(data: dict[str, Any], context: Context) -> Inspection:
    """Return the inspection of a document.

    Raises:
        InputError: Two stations have the same name, or a camera's covariance is none.
    """
    ratio, error = data.get("length_ratio"), data.get("predicted_error")
    return Inspection(
        setup=context.declared,
        stations=residuals_from_data(data["stations"], context.place),
        diagnosis=parts.findings_from_data(data.get("diagnosis", [])),
        hypotheses=tuple(_hypothesis(item) for item in data.get("hypotheses", [])),
        length_ratio=LengthRatio(float(ratio["ratio"]), float(ratio["sigma"])) if ratio else None,
        free=free_from_data(data.get("free", [])),
        predicted_error=parts.predicted_error_from_data(error) if error else None,
        surfaces=_surfaces(data.get("surfaces")),
        blame=_blame(data.get("blame")),
        time_offset=_offset(data.get("time_offset")),
        recording=summary_from_data(data.get("recording"), context.place),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
    )


def data_from_record(record: Inspection) -> dict[str, Any]:
    """Return the document of an inspection."""
    return parts.without_unknown(
        {
            "schema": header("inspection"),
            "setup": None if record.setup is None else str(record.setup),
            "diagnosis": parts.data_from_findings(record.diagnosis),
            "stations": data_from_residuals(record.stations),
            "hypotheses": [_data_from_hypothesis(each) for each in record.hypotheses] or None,
            "length_ratio": _data_from_ratio(record.length_ratio),
            "free": data_from_free(record.free),
            "predicted_error": parts.data_from_predicted_error(record.predicted_error),
            "surfaces": _data_from_surfaces(record.surfaces),
            "blame": _data_from_blame(record.blame),
            "time_offset": _data_from_offset(record.time_offset),
            "recording": data_from_summary(record.recording),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _hypothesis(item: dict[str, Any]) -> HypothesisFit:
    return HypothesisFit(
        code=item["code"],
        description=item["description"],
        flag=item.get("flag", ""),
        rotation=from_milli(item["rotation_mrad"]),
        translation=from_milli(item["translation_mm"]),
    )


def _data_from_hypothesis(fit: HypothesisFit) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "code": fit.code,
            "description": fit.description,
            "flag": fit.flag or None,
            "rotation_mrad": to_milli(fit.rotation),
            "translation_mm": to_milli(fit.translation),
        }
    )


def _data_from_ratio(ratio: LengthRatio | None) -> dict[str, Any] | None:
    if ratio is None or not math.isfinite(ratio.sigma):
        return None
    return {"ratio": ratio.ratio, "sigma": ratio.sigma}


def _surfaces(data: dict[str, Any] | None) -> SmoothResiduals | None:
    if data is None:
        return None
    return SmoothResiduals(
        pixel=float(data["pixel"]),
        pixel_left=float(data["pixel_left"]),
        bow=from_milli(data.get("bow_mm", 0)),
        bow_sigma=_sigma(parts.optional_from_milli(data, "bow_sigma_mm")),
        aspect=float(data.get("aspect", 0.0)),
        aspect_sigma=_sigma(data.get("aspect_sigma")),
        shear=from_milli(data.get("shear_mrad", 0)),
        shear_sigma=_sigma(parts.optional_from_milli(data, "shear_sigma_mrad")),
        plate_share=float(data["plate_share"]),
        image_share=float(data["image_share"]),
    )


def _sigma(value: Any) -> float:
    """Return a standard deviation; one that is left out is infinite."""
    return math.inf if value is None else float(value)


def _known(sigma: float) -> float | None:
    return sigma if math.isfinite(sigma) else None


def _data_from_surfaces(seen: SmoothResiduals | None) -> dict[str, Any] | None:
    if seen is None:
        return None
    return parts.without_unknown(
        {
            "pixel": seen.pixel,
            "pixel_left": seen.pixel_left,
            "bow_mm": to_milli(seen.bow),
            "bow_sigma_mm": parts.optional_milli(_known(seen.bow_sigma)),
            "aspect": seen.aspect,
            "aspect_sigma": _known(seen.aspect_sigma),
            "shear_mrad": to_milli(seen.shear),
            "shear_sigma_mrad": parts.optional_milli(_known(seen.shear_sigma)),
            "plate_share": seen.plate_share,
            "image_share": seen.image_share,
        }
    )


def _blame(data: dict[str, Any] | None) -> BlameShares | None:
    if data is None:
        return None
    shares: dict[str, Any] = {
        f"{cause}_{part}": float(data[cause][part])
        for cause in _CAUSES
        for part in data.get(cause, {})
    }
    return BlameShares(
        rotation=from_milli(data["rotation_mrad"]),
        translation=from_milli(data["translation_mm"]),
        limit=data["limit"],
        words=data.get("words", ""),
        **shares,
    )


def _data_from_blame(blame: BlameShares | None) -> dict[str, Any] | None:
    if blame is None:
        return None
    return parts.without_unknown(
        {
            "limit": blame.limit,
            "words": blame.words or None,
            "rotation_mrad": to_milli(blame.rotation),
            "translation_mm": to_milli(blame.translation),
            **{cause: _shares(blame, cause) for cause in _CAUSES},
        }
    )


def _offset(data: dict[str, Any] | None) -> TimeOffset | None:
    if data is None:
        return None
    return TimeOffset(
        offset=from_milli(data["offset_ms"]),
        sigma=from_milli(data["sigma_ms"]),
        jitter=from_milli(data["jitter_ms"]),
        frames=data["frames"],
        given=from_milli(data.get("given_ms", 0)),
    )


def _data_from_offset(offset: TimeOffset | None) -> dict[str, Any] | None:
    if offset is None:
        return None
    return {
        "offset_ms": to_milli(offset.offset),
        "sigma_ms": to_milli(offset.sigma),
        "jitter_ms": to_milli(offset.jitter),
        "frames": offset.frames,
        "given_ms": to_milli(offset.given),
    }


def _shares(blame: BlameShares, cause: str) -> dict[str, float] | None:
    both = {part: getattr(blame, f"{cause}_{part}") for part in ("rotation", "translation")}
    return parts.without_unknown(both) or None
