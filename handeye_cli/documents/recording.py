"""Recording documents: images on disk and the robot's poses."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.context import Context
from handeye_cli.documents.line import data_from_line, line_fields, optional_target
from handeye_cli.documents.place import Place
from handeye_cli.documents.station_parts import robot_pose, robot_pose_data, station_names
from handeye_cli.errors import InputError
from handeye_cli.images import ImageFile
from handeye_cli.records import RecordedStation, Recording


def record_from_data(data: dict[str, Any], context: Context) -> Recording:
    """Return the recording of a document; its images are looked at later.

    Raises:
        InputError: A pose is none, a name comes twice, or an image lies outside the folder.
    """
    place = context.place.key("stations")
    entries = data["stations"]
    stems = [PurePosixPath(entry["image"]).stem for entry in entries]
    names = station_names(entries, place, stems)
    stations = tuple(
        _station(entry, name, context, place.item(index).of_station(name))
        for index, (entry, name) in enumerate(zip(entries, names, strict=True))
    )
    return Recording(stations=stations, target=optional_target(data), **line_fields(data, context))


def data_from_record(record: Recording) -> dict[str, Any]:
    """Return the document of a recording.

    Raises:
        InputError: An image is not a file of its own.
    """
    return data_from_line(record, "recording", [_entry(station) for station in record.stations])


def _station(entry: dict[str, Any], name: str, context: Context, place: Place) -> RecordedStation:
    image = _image(entry["image"], context, place.key("image"))
    pose, written = robot_pose(entry, context, place)
    return RecordedStation(name, pose, image, written)


def _entry(station: RecordedStation) -> dict[str, Any]:
    if not isinstance(station.image, ImageFile):
        raise InputError(
            "expected an image that is a file, found one inside another recording",
            where=station.image.label,
        )
    head = {"name": station.name, "image": station.image.label}
    return parts.without_unknown(head | robot_pose_data(station))


def _image(text: str, context: Context, place: Place) -> ImageFile:
    try:
        path = (context.folder / text).resolve()
        inside = path.is_relative_to(context.folder.resolve())
    # a null byte is a ValueError, a loop of links a RuntimeError before Python 3.13
    except (OSError, ValueError, RuntimeError) as error:
        message = f"expected the path of an image, found {text!r}: {error}"
        raise InputError(message, where=str(place)) from error
    if not inside and not context.allow_outside:
        raise InputError(
            f"expected an image inside the folder of the document, found {text!r}, which is {path}",
            where=str(place),
            hint="allow it with --allow-outside",
        )
    return ImageFile(Path(path), text)
