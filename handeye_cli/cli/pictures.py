"""The pictures of `extract --draw`: one for each station, in a folder, to be looked at."""

from __future__ import annotations

import sys
import unicodedata
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from handeye_cli.cli.folders import prepared
from handeye_cli.cli.options import Output, Pictures
from handeye_cli.errors import InputError

if TYPE_CHECKING:
    from handeye_cli.pipeline import Steps
    from handeye_cli.records import Camera, Features, RecordedStation, Recording, Station
    from handeye_cli.targets import Board

_KEPT = frozenset("-_.+=@ ")
"""Signs that stay in a file's name beside letters and digits."""
_LONGEST = 50
"""Signs of a station's name that go into a file's; four bytes each fit into any file system."""
_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", *(f"{port}{k}" for port in ("com", "lpt") for k in range(10))]
)
"""Names that are no files on Windows, with any ending."""


@contextmanager
def prepared_folder(pictures: Pictures, output: Output, recording: Recording) -> Iterator[None]:
    """Make the folder for the pictures before any work is done for them; undo it if that fails.

    Raises:
        UsageError: It is no folder, or a picture exists and is not to be replaced.
        InputError: It cannot be made.
    """
    if pictures.draw is None:
        yield
        return
    paths = _paths(pictures.draw, recording.stations)
    with prepared(pictures.draw, paths, "--draw", force=output.force):
        yield


def draw_pictures(
    pictures: Pictures, output: Output, recording: Recording, features: Features, steps: Steps
) -> None:
    """Write a picture of what was found at each station; each image is loaded once more.

    An image that cannot be read has no picture; that is said on stderr.

    Args:
        pictures: Where to.
        output: Whether files may be replaced.
        recording: Where the images are.
        features: What was found in them.
        steps: How the work is shared out, and who is told of it.

    Raises:
        UsageError: A picture exists and is not to be replaced.
        InputError: A picture cannot be written.
    """
    if pictures.draw is None:
        return
    from handeye_cli import targets
    from handeye_cli.extract import each_image
    from handeye_cli.render.text import printable

    paths = _paths(pictures.draw, recording.stations)
    jobs = list(map(_Job, recording.stations, features.stations, paths))
    board = targets.build(features.target)
    draw = partial(_draw, board=board, camera=features.camera, force=output.force)
    for note in each_image(draw, jobs, workers=steps.workers, progress=steps.progress):
        if note is not None:
            sys.stderr.write(f"{printable(note)}\n")


@dataclass(frozen=True)
class _Job:
    recorded: RecordedStation
    station: Station
    path: str


def _draw(job: _Job, *, board: Board, camera: Camera | None, force: bool) -> str | None:
    """Write one picture, or return why there is none."""
    import cv2

    from handeye_cli import documents
    from handeye_cli.render.detection_picture import draw_detection

    try:
        grey = job.recorded.image.load()
    except InputError as error:
        return f"note: no picture of station {job.station.name}: {error}"
    discs = board.drawing().discs
    picture = draw_detection(grey, job.station, board.points(), discs=discs, camera=camera)
    documents.write_bytes(cv2.imencode(".png", picture)[1].tobytes(), job.path, force)
    return None


def file_names(names: Sequence[str]) -> list[str]:
    """Return a file's name without its ending for each station's name, all different.

    A name that is fit for a file stays as it is. In others, signs that mean something to a file
    system become `_`, and a number makes those different that would be the same, in a file system
    that does not tell capitals either.
    """
    fit = [_fit(name) for name in names]
    found: dict[int, str] = {}
    taken: set[str] = set()
    counts: Counter[str] = Counter()
    # those that stay as they are come first, so that no other takes their name
    for index in sorted(range(len(names)), key=lambda k: fit[k] != names[k]):
        stem = name = fit[index]
        while name.casefold() in taken:
            counts[stem] += 1
            name = f"{stem}-{counts[stem] + 1}"
        taken.add(name.casefold())
        found[index] = name
    return [found[index] for index in range(len(names))]


def _fit(name: str) -> str:
    plain = unicodedata.normalize("NFC", name)[:_LONGEST]
    kept = "".join(sign if sign.isalnum() or sign in _KEPT else "_" for sign in plain)
    # neither hidden nor a flag of some tool, and with an end that Windows keeps
    kept = kept.lstrip(" .-").rstrip(" .")
    return f"_{kept}" if not kept or kept.partition(".")[0].casefold() in _DEVICES else kept


def _paths(folder: str, stations: Sequence[RecordedStation]) -> list[str]:
    names = file_names([station.name for station in stations])
    return [str(Path(folder) / f"{name}.png") for name in names]
