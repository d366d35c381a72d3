"""Calibration documents: where the camera sits on its mount, and how sure that is."""

from __future__ import annotations

from typing import Any

import numpy as np

from handeye_cli.documents import parts
from handeye_cli.documents.comparison import comparison_from_data, data_from_comparison
from handeye_cli.documents.context import Context
from handeye_cli.documents.covariances import covariance_from_data, data_from_covariance
from handeye_cli.documents.factors import (
    data_from_factors,
    data_from_improvements,
    factors_from_data,
    improvements_from_data,
)
from handeye_cli.documents.free import data_from_free, free_from_data
from handeye_cli.documents.poses import data_from_pose, pose_from_data
from handeye_cli.documents.residuals import data_from_residuals, residuals_from_data
from handeye_cli.documents.schema import header
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.errors import InputError
from handeye_cli.records import (
    Calibration,
    FloatArray,
    Noise,
    UncertainPose,
    WithoutBadStations,
)


def record_from_data(data: dict[str, Any], context: Context) -> Calibration:
    """Return the calibration of a document.

    Raises:
        InputError: Its poses are not those of its setup or are none, a name comes twice, or a
            pair is not one of its stations.
    """
    setup = context.setup
    answer, constant = _pose(data, setup.answer, context), _pose(data, setup.constant, context)
    return Calibration(
        setup=setup,
        method=data["method"],
        mount_T_camera=answer,
        reference_T_target=constant,
        predicted_error=parts.predicted_error_from_data(data["predicted_error"]),
        noise=parts.noise_from_data(data["noise"]) or Noise(),
        noise_estimated=data.get("noise_estimated", True),
        stations=residuals_from_data(data["stations"], context.place),
        pairs=parts.pairs_from_data(data.get("pairs", []), len(data["stations"]), context.place),
        factors=factors_from_data(data.get("factors")),
        improvements=improvements_from_data(data.get("improvements", [])),
        diagnosis=parts.findings_from_data(data.get("diagnosis", [])),
        camera=parts.camera_from_data(data.get("camera"), context.place),
        provenance=parts.provenance_from_data(data.get("provenance", [])),
        covariance_between=_between(data, answer, constant, context),
        noise_freedom=float(data["noise_freedom"]) if "noise_freedom" in data else None,
        comparison=comparison_from_data(data.get("comparison", [])),
        without=_without_from_data(data.get("without")),
        free=free_from_data(data.get("free", [])),
    )


def data_from_record(record: Calibration) -> dict[str, Any]:
    """Return the document of a calibration."""
    return parts.without_unknown(
        {
            "schema": header("calibration"),
            "setup": str(record.setup),
            "method": record.method,
            record.setup.answer: data_from_pose(record.mount_T_camera),
            record.setup.constant: data_from_pose(record.reference_T_target),
            "free": data_from_free(record.free),
            "covariance_between": data_from_covariance(record.covariance_between),
            "predicted_error": parts.data_from_predicted_error(record.predicted_error),
            "noise": parts.data_from_noise(record.noise),
            "noise_estimated": record.noise_estimated,
            "noise_freedom": record.noise_freedom,
            "stations": data_from_residuals(record.stations),
            "without": _data_from_without(record.without),
            "pairs": parts.data_from_pairs(record.pairs),
            "factors": data_from_factors(record.factors),
            "improvements": data_from_improvements(record.improvements),
            "comparison": data_from_comparison(record.comparison),
            "diagnosis": parts.data_from_findings(record.diagnosis),
            "camera": parts.data_from_camera(record.camera),
            "provenance": parts.data_from_provenance(record.provenance),
        }
    )


def _without_from_data(data: dict[str, Any] | None) -> WithoutBadStations | None:
    if data is None:
        return None
    return WithoutBadStations(
        left_out=tuple(str(name) for name in data["stations"]),
        rotation=from_milli(data["rotation_mrad"]),
        translation=from_milli(data["translation_mm"]),
    )


def _data_from_without(effect: WithoutBadStations | None) -> dict[str, Any] | None:
    if effect is None:
        return None
    return {
        "stations": list(effect.left_out),
        "rotation_mrad": to_milli(effect.rotation),
        "translation_mm": to_milli(effect.translation),
    }


def _pose(data: dict[str, Any], key: str, context: Context) -> UncertainPose:
    if key not in data:
        found = ", ".join(name for name in data if "_T_" in name)
        raise InputError(
            f"expected the key {key!r} of an {context.setup} calibration, found {found}",
            where=str(context.place),
        )
    return pose_from_data(data[key], context.poses, context.place.key(key))


def _between(
    data: dict[str, Any], answer: UncertainPose, constant: UncertainPose, context: Context
) -> FloatArray | None:
    """Return the covariance of the two poses with each other; with their own it is one of both."""
    if "covariance_between" not in data:
        return None
    place = context.place.key("covariance_between")
    if answer.covariance is None or constant.covariance is None:
        raise InputError(
            "expected it beside the covariances of both poses, found it without", where=str(place)
        )
    scale = np.array([context.poses.units.metres] * 3 + [1.0] * 3)
    between = np.array(data["covariance_between"], dtype=float) * np.outer(scale, scale)
    joint = np.block([[answer.covariance, between], [between.T, constant.covariance]])
    covariance_from_data(joint.tolist(), 12, place)
    return between
