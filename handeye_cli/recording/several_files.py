"""The files of a recording, also when several of them are named one by one.

A recorder splits a long recording, and sometimes one node records the camera and another the robot.
Where a folder has its metadata to say the order, files that are named one by one have their times.
"""

from __future__ import annotations

import math
from pathlib import Path

from handeye_cli.errors import UsageError
from handeye_cli.recording import bag_folder, container, findings
from handeye_cli.recording.bag_folder import BagFiles
from handeye_cli.recording.losses import Losses
from handeye_cli.wording import first_few

Paths = str | tuple[str, ...]
"""A file or a folder, or several of them that are read as one recording."""


def name_of(paths: Paths) -> str:
    """Return what a recording is called in messages."""
    return paths if isinstance(paths, str) else first_few(paths, 1)


def files_of(paths: Paths) -> BagFiles:
    """Return the files of a recording; of several that are named, in the order of their times.

    Args:
        paths: What was named; files are looked into only where there are several.

    Raises:
        InputError: A folder cannot be read or has no MCAP files; or one of several files cannot be
            opened or is no MCAP file.
        UsageError: A file is named twice.
    """
    if isinstance(paths, str):
        return bag_folder.files_of(paths)
    parts = [bag_folder.files_of(path) for path in paths]
    files = sorted((file for part in parts for file in part.paths), key=_first_time)
    _require_different(files)
    missing = [each for part in parts for each in part.findings if each.severity != "info"]
    order = [findings.files(files)] if len(files) > 1 else []
    return BagFiles(tuple(files), (*order, *missing))


def _first_time(path: str) -> float:
    """Return the time of recording of a file's first message; a file without any is the last."""
    first = next(container.scan(path, lambda _: True, Losses()), None)
    return math.inf if first is None else first.log_time_ns


def _require_different(files: list[str]) -> None:
    seen: dict[Path, str] = {}
    for file in files:
        place = Path(file).resolve()
        if place in seen:
            raise UsageError(
                f"expected different files of one recording, found one of them twice: {seen[place]}"
                f" and {file}",
                hint="name every file once, or the folder that holds them",
            )
        seen[place] = file
