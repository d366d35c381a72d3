"""The images of a case, small enough for a page, with what was found in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from handeye_cli import targets
from handeye_cli.errors import InputError
from handeye_cli.extract import each_image
from handeye_cli.pipeline import Steps
from handeye_cli.records import Camera, Features, FloatArray, GreyImage, RecordedStation, Station
from handeye_cli.reporting.case import Case

MOST = 60
"""Images of a case that are shown."""
_SIDE = 800
"""Pixels of the longer side of an image on a page with few of them."""
_SMALLEST = 400
_FEW = 15
"""With more images than this each becomes smaller, so that their pixels together stay the same."""


@dataclass(frozen=True)
class Picture:
    """An image of a station, scaled for the page.

    Attributes:
        station: What was found, in pixels of the scaled image.
        grey: (height, width) levels, or None where the image cannot be read.
        camera: Intrinsics of the scaled image, if they are known.
        reason: Why there is no image.
    """

    station: Station
    grey: GreyImage | None
    camera: Camera | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Album:
    """The images of a case.

    Attributes:
        pictures: Of the first stations.
        total: Number of stations.
        points: (n, 3) points of the target that observations point into, metres.
        discs: (m, 3) centre and radius of the target's discs, metres.
    """

    pictures: tuple[Picture, ...]
    total: int
    points: FloatArray
    discs: FloatArray


def album_of(case: Case, steps: Steps) -> Album | None:
    """Return the images of a case, or None where no recording was reached that holds them.

    Args:
        case: With features and the recording they come from.
        steps: How the images are looked at.
    """
    recording, features = case.recording, case.features
    if recording is None or features is None:
        return None
    board = targets.build(features.target)
    found = {each.name: each for each in features.stations}
    shown = [(each, found[each.name]) for each in recording.stations if each.name in found][:MOST]
    side = int(np.clip(_SIDE * np.sqrt(_FEW / max(len(shown), 1)), _SMALLEST, _SIDE))
    look = partial(_picture, camera=_camera(case, features), side=side)
    return Album(
        pictures=tuple(each_image(look, shown, workers=steps.workers, progress=steps.progress)),
        total=len(recording.stations),
        points=board.points(),
        discs=board.drawing().discs,
    )


def _camera(case: Case, features: Features) -> Camera | None:
    if case.calibration is not None and case.calibration.camera is not None:
        return case.calibration.camera
    return features.camera


def _picture(pair: tuple[RecordedStation, Station], *, camera: Camera | None, side: int) -> Picture:
    recorded, station = pair
    try:
        grey = recorded.image.load()
    except InputError as error:
        return Picture(station, None, reason=str(error))
    scale = side / max(grey.shape)
    return Picture(
        station=_scaled_station(station, scale),
        grey=_scaled(grey, scale),
        camera=None if camera is None else scaled_camera(camera, scale),
    )


def _scaled(grey: GreyImage, scale: float) -> GreyImage:
    import cv2

    height, width = (max(round(scale * side), 1) for side in grey.shape)
    way = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(grey, (width, height), interpolation=way), dtype=np.uint8)


def _scaled_station(station: Station, scale: float) -> Station:
    seen = station.observation
    if seen is None:
        return station
    return replace(station, observation=replace(seen, pixels=_moved(seen.pixels, scale)))


def scaled_camera(camera: Camera, scale: float) -> Camera:
    """Return the intrinsics of an image that was made larger or smaller."""
    cx, cy = _moved(np.array([camera.cx, camera.cy]), scale).tolist()
    return replace(
        camera,
        width=round(scale * camera.width),
        height=round(scale * camera.height),
        fx=scale * camera.fx,
        fy=scale * camera.fy,
        cx=cx,
        cy=cy,
        covariance=None,
    )


def _moved(pixels: FloatArray, scale: float) -> FloatArray:
    # the corner of the image stays, and pixel (0, 0) is the centre of the first one
    return np.asarray((pixels + 0.5) * scale - 0.5)
