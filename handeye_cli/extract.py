"""The stage from images to the target's points in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from handeye_cli import targets
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import (
    Camera,
    Features,
    Finding,
    GreyImage,
    Observation,
    RecordedStation,
    Recording,
    Station,
)
from handeye_cli.targets import image_faults

Given = TypeVar("Given")
Made = TypeVar("Made")

_NAMED = 5
"""Unused images that are named in the finding; the document has them all."""
MOST_WORKERS = 8
"""Images looked at at the same time, unless more are asked for."""


def extract(
    recording: Recording,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Features:
    """Find the target in every image of a recording.

    No more than `workers` images are in memory at a time, and their number does not change the
    result. Every station is kept: one whose image cannot be read or shows no target says why.

    Args:
        recording: Images and robot poses, with the target.
        workers: Images looked at at the same time; one per processor, up to 8, when None.
        progress: Told (done, all) after each image, in the order of the stations, or None.

    Returns:
        The points of each station. Those of a plate that looks the same after a turn are numbered
        consistently over the stations.

    Raises:
        UsageError: The recording does not name its target, or there are no workers.
        InputError: The target is not valid.
    """
    if recording.target is None:
        raise UsageError(
            "the recording does not say what the calibration target is",
            hint=f"add --target, such as {_examples()}",
        )
    board = targets.build(recording.target)
    look = partial(_look, board=board, camera=recording.camera)
    looks = each_image(look, recording.stations, workers=workers, progress=progress)
    shown = [each.seen for each in looks if each.seen is not None]
    settled, choice = board.settled(shown)
    if len({seen.note for seen in shown}) > 1:
        # what an image alone took for another look is looked at as what all of them show
        look = partial(_look, board=settled, camera=recording.camera)
        looks = each_image(look, recording.stations, workers=workers)
    size = _common_size(looks)
    stations = tuple(_of_size(each, size) for each in looks)
    features = Features(
        setup=recording.setup,
        stations=stations,
        target=recording.target if settled is board else settled.spec,
        camera=recording.camera,
        image_size=size,
        noise=recording.noise,
        findings=recording.findings + ((choice,) if choice else ()) + _unused(stations),
        provenance=recording.provenance,
    )
    return _ordered(features, settled)


def each_image(
    work: Callable[[Given], Made],
    images: Sequence[Given],
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Made]:
    """Return what is made of each image, several of them at the same time.

    Args:
        work: What is done with one; it loads the image and keeps nothing of it.
        images: What each can be loaded from.
        workers: Images worked on at the same time; one per processor, up to 8, when None.
        progress: Told (done, all) after each image, in their order, or None.

    Returns:
        The results in the order of the images.

    Raises:
        UsageError: There are no workers.
    """
    if workers is not None and workers < 1:
        raise UsageError(f"expected at least 1 worker, found {workers}", where="--workers")
    made: list[Made] = []
    with ThreadPoolExecutor(workers or min(MOST_WORKERS, os.cpu_count() or 1)) as pool:
        for each in pool.map(work, images):
            made.append(each)
            if progress is not None:
                progress(len(made), len(images))
    return made


@dataclass(frozen=True)
class _Look:
    """A station after a look at its image.

    Attributes:
        station: With what was found, or the reason why nothing was.
        size: Width and height of the image, None when it could not be read.
        seen: What was found, or None.
    """

    station: Station
    size: tuple[int, int] | None = None
    seen: targets.Detection | None = None


def _look(recorded: RecordedStation, board: targets.Board, camera: Camera | None) -> _Look:
    station = Station(recorded.name, recorded.base_T_gripper, written=recorded.written)
    try:
        grey = recorded.image.load()
    except InputError as error:
        return _Look(_without(station, str(error)))
    wrong = _wrong_size(grey, camera)
    if wrong is not None:
        return _Look(_without(station, wrong))
    rough = board.detect(grey)
    seen = replace(board.refine(grey, rough, camera), note=rough.note)
    size = (grey.shape[1], grey.shape[0])
    if seen.reason is not None:
        return _Look(_without(station, _with_fault(seen.reason, grey)), size)
    observation = Observation(seen.ids, seen.pixels, seen.sigma_px)
    return _Look(replace(station, observation=observation), size, seen)


def _with_fault(reason: str, grey: GreyImage) -> str:
    """Return why the target was not found, with the fault of the image if it is to blame."""
    fault = image_faults.fault(grey)
    return reason if fault is None or fault in reason else f"{reason}: {fault}"


def _common_size(looks: Sequence[_Look]) -> tuple[int, int] | None:
    """Return the size that most images have, the first of them when several do."""
    sizes = [look.size for look in looks if look.size is not None]
    return max(dict.fromkeys(sizes), key=sizes.count) if sizes else None


def _of_size(look: _Look, size: tuple[int, int] | None) -> Station:
    if look.size is None or size is None or look.size == size:
        return look.station
    found = f"found one of {look.size[0]}x{look.size[1]}"
    reason = f"expected an image of {size[0]}x{size[1]} as most of the recording's, {found}"
    return _without(look.station, reason)


def _unused(stations: Sequence[Station]) -> tuple[Finding, ...]:
    lost = [station for station in stations if station.reason is not None]
    if not lost:
        return ()
    named = "; ".join(f"{station.name}: {station.reason}" for station in lost[:_NAMED])
    more = f"; and {len(lost) - _NAMED} more" if len(lost) > _NAMED else ""
    message = f"{len(lost)} of {len(stations)} images are not used: {named}{more}"
    return (Finding("images-unused", "warning", message),)


def _without(station: Station, reason: str) -> Station:
    return replace(station, observation=None, reason=reason)


def _wrong_size(grey: GreyImage, camera: Camera | None) -> str | None:
    height, width = grey.shape
    if camera is None or (width, height) == (camera.width, camera.height):
        return None
    expected = f"{camera.width}x{camera.height}"
    return f"expected an image of {expected} as the camera's, found one of {width}x{height}"


def _ordered(features: Features, board: targets.Board) -> Features:
    turns = board.turns()
    if len(turns) < 2:
        return features
    from handeye_cli.ordering import order_consistently

    return order_consistently(features, board.points(), turns)


def _examples() -> str:
    names = ("disc-grid", "chessboard", "charuco")
    return " or ".join(targets.board_class(name).EXAMPLE for name in names)
