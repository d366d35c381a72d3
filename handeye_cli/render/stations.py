"""The reports on the way to a calibration: the points that were found, and the poses they give."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from handeye_cli import targets
from handeye_cli.records import Features, FloatArray, Station, Stations, UncertainPose
from handeye_cli.render.console import show_table
from handeye_cli.render.text import NOTHING, count, deg, mm, mrad, pixels


def show_features(features: Features, console: Console) -> None:
    """Print what was found in every picture."""
    found = sum(station.observation is not None for station in features.stations)
    pictures = count(len(features.stations), "picture")
    console.print(f"Target found in {found} of {pictures} ({features.setup.value})", style="bold")
    console.print(f"{targets.shorthand(features.target)}\n")
    told = any(each.observation and each.observation.sigma_px for each in features.stations)
    rows = [
        [station.name, *_seen(station)[: 2 if told else 1], station.reason or ""]
        for station in features.stations
    ]
    headings = ["station", "points", *(["sigma\npx"] if told else []), ""]
    show_table(console, headings, rows, left=[0, len(headings) - 1])


def show_stations(stations: Stations, console: Console) -> None:
    """Print where the target is for the camera, station by station."""
    posed = sum(station.camera_T_target is not None for station in stations.stations)
    total = count(len(stations.stations), "station")
    console.print(f"camera_T_target known for {posed} of {total} ({stations.setup.value})\n")
    rows = [
        [station.name, _seen(station)[0], *_posed(station.camera_T_target), station.reason or ""]
        for station in stations.stations
    ]
    headings = [
        "station",
        "points",
        "distance\nmm",
        "tilt\ndeg",
        "sigma\nmrad",
        "sigma\nmm",
        "",
    ]
    show_table(console, headings, rows, left=[0, 6])


def _seen(station: Station) -> list[str]:
    seen = station.observation
    return [NOTHING, NOTHING] if seen is None else [str(len(seen.ids)), pixels(seen.sigma_px)]


def _posed(pose: UncertainPose | None) -> list[str]:
    if pose is None:
        return [NOTHING] * 4
    distance = float(np.linalg.norm(pose.matrix[:3, 3]))
    normal = pose.matrix[:3, 2]
    tilt = float(np.arctan2(np.hypot(normal[0], normal[1]), abs(normal[2])))
    return [mm(distance), deg(tilt), *_magnitudes(pose.covariance)]


def _magnitudes(covariance: FloatArray | None) -> list[str]:
    if covariance is None:
        return [NOTHING, NOTHING]
    variances = np.diag(covariance)
    return [mrad(float(np.sqrt(variances[3:].sum()))), mm(float(np.sqrt(variances[:3].sum())))]
