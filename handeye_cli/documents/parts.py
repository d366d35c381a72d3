"""The parts that several kinds of document share: camera, target, noise, findings, provenance.

Every part has a reader and a writer that undo each other. A writer leaves out what is unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from handeye_cli.documents.covariances import covariance_from_data, data_from_covariance
from handeye_cli.documents.place import Place
from handeye_cli.documents.units import from_milli, to_milli, with_floats
from handeye_cli.errors import InputError
from handeye_cli.records import (
    Camera,
    Finding,
    Noise,
    PaperPrediction,
    PredictedError,
    ProvenanceStep,
    TargetSpec,
)

_NOISE_KEYS = {
    "robot_rotation": "robot_rotation_mrad",
    "robot_translation": "robot_translation_mm",
    "camera_rotation": "camera_rotation_mrad",
    "camera_translation": "camera_translation_mm",
}


def without_unknown(data: dict[str, Any]) -> dict[str, Any]:
    """Return a mapping without the keys whose value is None."""
    return {key: value for key, value in data.items() if value is not None}


def optional_milli(value: float | None) -> Any:
    """Return radians or metres as mrad or mm, or None when unknown."""
    return None if value is None else to_milli(value)


def optional_from_milli(data: dict[str, Any], key: str) -> float | None:
    """Return a key's mrad or mm in radians or metres, or None where the key is missing."""
    return from_milli(data[key]) if key in data else None


def camera_from_data(data: dict[str, Any] | None, place: Place) -> Camera | None:
    """Return the camera of a `camera:` mapping, or None without one.

    Raises:
        InputError: Its covariance is not one of its parameters.
    """
    if data is None:
        return None
    place = place.key("camera")
    distortion = tuple(float(number) for number in data.get("distortion", ()))
    size = 4 + len(distortion)
    rows = data.get("covariance")
    return Camera(
        width=int(data["width"]),
        height=int(data["height"]),
        fx=float(data["fx"]),
        fy=float(data["fy"]),
        cx=float(data["cx"]),
        cy=float(data["cy"]),
        distortion=distortion,
        model=data.get("model", "plumb_bob"),
        covariance=None
        if rows is None
        else covariance_from_data(rows, size, place.key("covariance")),
    )


def data_from_camera(camera: Camera | None) -> dict[str, Any] | None:
    """Return a camera as a `camera:` mapping."""
    if camera is None:
        return None
    return without_unknown(
        {
            "width": camera.width,
            "height": camera.height,
            "fx": camera.fx,
            "fy": camera.fy,
            "cx": camera.cx,
            "cy": camera.cy,
            "distortion": list(camera.distortion),
            "model": camera.model,
            "covariance": data_from_covariance(camera.covariance),
        }
    )


def target_from_data(data: dict[str, Any]) -> TargetSpec:
    """Return the target of a `target:` mapping; its keys are checked where targets are known."""
    parameters = with_floats(data)
    return TargetSpec(type=parameters.pop("type"), parameters=parameters)


def data_from_target(target: TargetSpec | None) -> dict[str, Any] | None:
    """Return a target as a `target:` mapping."""
    return None if target is None else {"type": target.type, **target.parameters}


def noise_from_data(data: dict[str, Any] | None) -> Noise | None:
    """Return the noise of a `noise:` mapping, or None without one."""
    if data is None:
        return None
    levels = {name: optional_from_milli(data, key) for name, key in _NOISE_KEYS.items()}
    return Noise(**levels, pixel=float(data["pixel"]) if "pixel" in data else None)


def data_from_noise(noise: Noise | None) -> dict[str, Any] | None:
    """Return noise levels as a `noise:` mapping."""
    if noise is None:
        return None
    levels = {key: optional_milli(getattr(noise, name)) for name, key in _NOISE_KEYS.items()}
    return without_unknown({**levels, "pixel": noise.pixel})


def predicted_error_from_data(data: dict[str, Any]) -> PredictedError:
    """Return the prediction of a `predicted_error:` mapping."""
    paper = data.get("paper")
    return PredictedError(
        rotation=from_milli(data["rotation_mrad"]),
        translation=from_milli(data["translation_mm"]),
        rotation_95=from_milli(data["rotation_95_mrad"]),
        translation_95=from_milli(data["translation_95_mm"]),
        paper=None if paper is None else _paper_from_data(paper),
    )


def _paper_from_data(data: dict[str, Any]) -> PaperPrediction:
    return PaperPrediction(
        rotation=from_milli(data["rotation_mrad"]),
        translation=from_milli(data["translation_mm"]),
        rotation_max=from_milli(data["rotation_max_mrad"]),
        translation_max=from_milli(data["translation_max_mm"]),
    )


def data_from_predicted_error(error: PredictedError | None) -> dict[str, Any] | None:
    """Return a prediction as a `predicted_error:` mapping."""
    if error is None:
        return None
    return without_unknown(
        {
            "rotation_mrad": to_milli(error.rotation),
            "translation_mm": to_milli(error.translation),
            "rotation_95_mrad": to_milli(error.rotation_95),
            "translation_95_mm": to_milli(error.translation_95),
            "paper": None if error.paper is None else _data_from_paper(error.paper),
        }
    )


def _data_from_paper(paper: PaperPrediction) -> dict[str, Any]:
    return {
        "rotation_mrad": to_milli(paper.rotation),
        "translation_mm": to_milli(paper.translation),
        "rotation_max_mrad": to_milli(paper.rotation_max),
        "translation_max_mm": to_milli(paper.translation_max),
    }


def pairs_from_data(
    data: list[list[Any]], stations: int, place: Place
) -> tuple[tuple[int, int], ...]:
    """Return interstation pairs, each of two of the document's stations.

    Raises:
        InputError: A pair names a station that is not there, or one station twice.
    """
    for index, (i, j) in enumerate(data):
        if max(i, j) >= stations or i == j:
            raise InputError(
                f"expected two of the {stations} stations (0 to {stations - 1}), found {[i, j]}",
                where=str(place.key("pairs").item(index)),
            )
    return tuple((int(i), int(j)) for i, j in data)


def data_from_pairs(pairs: Sequence[tuple[int, int]]) -> list[list[int]] | None:
    """Return pairs as rows, or None when there are none."""
    return [[int(i), int(j)] for i, j in pairs] or None


def findings_from_data(data: list[dict[str, Any]]) -> tuple[Finding, ...]:
    """Return the findings of a `findings:` or `diagnosis:` list."""
    return tuple(
        Finding(item["code"], item["severity"], item["message"], item.get("advice", ""))
        for item in data
    )


def data_from_findings(findings: Sequence[Finding]) -> list[dict[str, Any]] | None:
    """Return findings as a list, or None when there are none."""
    return [
        without_unknown(
            {
                "code": finding.code,
                "severity": finding.severity,
                "message": finding.message,
                "advice": finding.advice or None,
            }
        )
        for finding in findings
    ] or None


def provenance_from_data(data: list[dict[str, Any]]) -> tuple[ProvenanceStep, ...]:
    """Return the steps of a `provenance:` list."""
    return tuple(
        ProvenanceStep(
            command=step["command"],
            version=step["version"],
            inputs=tuple((entry["file"], entry["sha256"]) for entry in step.get("inputs", ())),
            options=with_floats(step.get("options", {})),
        )
        for step in data
    )


def data_from_provenance(steps: Sequence[ProvenanceStep]) -> list[dict[str, Any]] | None:
    """Return the steps as a `provenance:` list, or None when there are none."""
    return [
        {
            "command": step.command,
            "version": step.version,
            "inputs": [{"file": file, "sha256": sha256} for file, sha256 in step.inputs],
            "options": dict(step.options),
        }
        for step in steps
    ] or None
