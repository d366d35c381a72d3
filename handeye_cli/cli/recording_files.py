"""A simulated recording into files: a folder with a document and images, or an MCAP file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from handeye_cli.cli.folders import prepared
from handeye_cli.cli.pictures import file_names

if TYPE_CHECKING:
    from handeye_cli.records import ProvenanceStep
    from handeye_cli.simulate.footage import Footage
    from handeye_cli.simulate.recording import SimulatedRecording

Item = TypeVar("Item")
Progress = Callable[[int, int], None]

DOCUMENT = "recording.yaml"
"""Name of the document in its folder; the images are in a folder beside it."""
_IMAGES = "images"


@dataclass(frozen=True)
class Folder:
    """Where the files of a recording go.

    Attributes:
        path: The folder.
        labels: Paths of the images in it, one for each station.
        force: Whether files that are there may be replaced.
    """

    path: str
    labels: list[str]
    force: bool

    @property
    def document(self) -> str:
        """Path of the document."""
        return str(Path(self.path) / DOCUMENT)

    @property
    def images(self) -> list[str]:
        """Paths of the images."""
        return [str(Path(self.path) / label) for label in self.labels]


@contextmanager
def prepared_folder(path: str, names: Iterable[str], force: bool) -> Iterator[Folder]:
    """Make the folder of a recording before any work is done for it; take it away if that fails.

    Args:
        path: The folder.
        names: Of the stations.
        force: Whether files that are there may be replaced.

    Raises:
        UsageError: It is no folder, or a file of the recording exists and is not to be replaced.
        InputError: It cannot be made.
    """
    labels = [f"{_IMAGES}/{name}.png" for name in file_names(list(names))]
    folder = Folder(path, labels, force)
    with prepared(path, (folder.document, *folder.images), "-o", force=force):
        yield folder


def write_folder(
    simulated: SimulatedRecording, folder: Folder, step: ProvenanceStep, progress: Progress | None
) -> None:
    """Write the images, drawn one at a time, and at last the document that names them.

    Args:
        simulated: The recording. An image that is missing in it has its name in the document only.
        folder: Where to.
        step: How the recording came about.
        progress: Told (done, all) after each image, or None.

    Raises:
        UsageError: A file exists and is not to be replaced, or the target is behind the camera.
        InputError: A file cannot be written, or the lens leaves pixels without a direction.
    """
    from handeye_cli import documents
    from handeye_cli.images import ImageFile, encode_png

    stations = simulated.recording.stations
    files = zip(stations, folder.images, simulated.staging.missing, strict=True)
    for station, path, missing in _counted(files, len(stations), progress):
        if missing:
            # an image of an earlier recording must not stand in for it
            Path(path).unlink(missing_ok=True)
        else:
            documents.write_bytes(encode_png(station.image.load()), path, folder.force)
    named = tuple(
        replace(station, image=ImageFile(Path(path), label))
        for station, path, label in zip(stations, folder.images, folder.labels, strict=True)
    )
    recording = replace(simulated.recording, stations=named, provenance=(step,))
    documents.write(recording, folder.document, folder.force)


def write_mcap(
    footage: Footage,
    path: str,
    step: ProvenanceStep,
    progress: Progress | None,
    *,
    compressed: bool,
    force: bool,
) -> None:
    """Write a robot's run, its pictures drawn one at a time.

    Args:
        footage: What camera and robot send.
        path: The MCAP file.
        step: How the recording came about.
        progress: Told (done, all) after each picture, or None.
        compressed: Whether the pictures are PNG files.
        force: Whether a file that is there may be replaced.

    Raises:
        UsageError: The file exists and is not to be replaced, or the target is behind the camera.
        InputError: It cannot be written, or the lens leaves pixels without a direction.
    """
    from handeye_cli import documents
    from handeye_cli.recording import writing

    streams = writing.Streams(
        camera=footage.camera,
        pictures=_counted(footage.pictures(), footage.picture_count, progress),
        links=footage.links(),
        compressed=compressed,
        notes={"command": step.command, "version": step.version}
        | {name: str(value) for name, value in step.options.items()},
    )
    with documents.streamed_file(path, force) as file:
        writing.write(file, streams)


def _counted(items: Iterable[Item], total: int, progress: Progress | None) -> Iterator[Item]:
    for done, item in enumerate(items, start=1):
        yield item
        if progress is not None:
            progress(done, total)
