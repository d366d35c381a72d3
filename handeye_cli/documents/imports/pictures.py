"""Image files of other tools as the pictures of a recording document."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path, PurePath

from handeye_cli.documents.imports.foreign import ImportOptions
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.images import ImageFile

_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm", ".webp")


def is_image(name: str) -> bool:
    """Return whether a file is an image, by its ending."""
    return PurePath(name).suffix.lower() in _ENDINGS


def picture(path: str, options: ImportOptions, place: Place) -> ImageFile:
    """Return an image with the path that the new document gives it.

    Args:
        path: Where it is.
        options: Which folder that document is written into.
        place: Where the image is named.

    Raises:
        InputError: There is no such file, or it lies outside the document's folder.
    """
    file, folder = _resolved(path, place), options.folder.resolve()
    if not file.is_relative_to(folder) and not options.allow_outside:
        raise InputError(
            f"expected an image inside the folder of the new document, {folder}, found {path}",
            where=str(place),
            hint=f"write the document beside the images, such as -o {file.parent}/recording.yaml, "
            "or allow other places with --allow-outside",
        )
    return ImageFile(file, PurePath(os.path.relpath(file, folder)).as_posix())


def names_of(images: Sequence[ImageFile]) -> list[str]:
    """Return the names of the images' stations: their files' without endings, or their numbers.

    Files of different folders may share a name; then every station is called by its number.
    """
    stems = [PurePath(image.label).stem for image in images]
    if len(set(stems)) == len(stems):
        return stems
    return [f"{index:02d}" for index in range(len(images))]


def _resolved(path: str, place: Place) -> Path:
    try:
        file = Path(path).resolve()
        found = file.is_file()
    # a null byte is a ValueError, a loop of links a RuntimeError before Python 3.13
    except (OSError, ValueError, RuntimeError) as error:
        message = f"expected the path of an image, found {path!r}: {error}"
        raise InputError(message, where=str(place)) from error
    if not found:
        raise InputError(f"expected an image, found no file {path}", where=str(place))
    return file
