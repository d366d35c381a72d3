"""Robot poses in a table (CSV, or TUM as evo reads it) beside a folder of images.

A row is `base_T_gripper`, in metres unless a flag says otherwise. Which picture belongs to it is
never told by the order, but by a column: `image` names the file; `name`, `id` or `index` its name
or the number at its end; `timestamp` its time, when images are called by theirs as in TUM's data
sets. A time is in seconds, or in nanoseconds where it has 16 digits or more before the point.

Between two rows up to a tenth of a second apart the pose is interpolated. Every image becomes a
station, so the robot must have stood still for each. Tables do not say where the camera is fixed.
"""

from __future__ import annotations

from pathlib import Path

from handeye_cli.documents.imports.foreign import Foreign, ImportOptions, list_folder
from handeye_cli.documents.imports.pictures import is_image, names_of, picture
from handeye_cli.documents.imports.table import is_table, rows_of
from handeye_cli.documents.imports.table_pairs import (
    Pairs,
    Table,
    by_key,
    by_time,
    require_one_pose,
)
from handeye_cli.documents.imports.table_poses import reader
from handeye_cli.errors import InputError
from handeye_cli.images import ImageFile
from handeye_cli.records import Finding, RecordedStation, Recording
from handeye_cli.wording import first_few

_NAMED = 3
"""Images without a pose that a finding names."""


def recognises(foreign: Foreign) -> bool:
    """Return whether a file is a table of poses."""
    return is_table(foreign.content)


def read(foreign: Foreign, options: ImportOptions) -> Recording:
    """Return the recording of a table and its images.

    Raises:
        InputError: It is no table of poses, no image belongs to a row, or nothing says what its
            angles are, where its images are or where the camera is fixed.
        UsageError: `--rotation` is not written as it should be, or has nothing to act on.
    """
    rows = rows_of(foreign.content, foreign.name)
    table = Table(rows, reader(rows[0], options.rotation), options.conventions())
    setup = options.known_setup(None, foreign.place)
    if "image" in rows[0].cells:
        return Recording(setup, _named(foreign, table, options), options.target)
    images = _images(foreign, options)
    pairs = _paired(foreign, table, images)
    return Recording(setup, pairs.stations, options.target, findings=_unused(pairs, images))


def _named(foreign: Foreign, table: Table, options: ImportOptions) -> tuple[RecordedStation, ...]:
    folder = Path(foreign.beside("") if options.images is None else options.images)
    images = [
        picture(str(folder / row.cells["image"]), options, row.place.key("image"))
        for row in table.rows
    ]
    require_one_pose(images, table.rows)
    return tuple(
        table.station(name, row, image)
        for name, row, image in zip(names_of(images), table.rows, images, strict=True)
    )


def _paired(foreign: Foreign, table: Table, images: list[ImageFile]) -> Pairs:
    columns = table.rows[0].cells
    if not {"key", "time"} & columns.keys():
        raise InputError(
            "expected a column that says which image belongs to a pose, found only "
            f"{', '.join(filter(None, columns))}",
            where=foreign.name,
            hint="add a column image, name, index or timestamp",
        )
    pairs = by_key(table, images) if "key" in columns else by_time(table, images)
    if not pairs.stations:
        raise InputError(
            f"expected images called by the table's {pairs.called}, found {images[0].label}",
            where=foreign.name,
            hint="add a column image with the names of the files",
        )
    return pairs


def _images(foreign: Foreign, options: ImportOptions) -> list[ImageFile]:
    if options.images is None:
        raise InputError(
            "expected to learn where the images are, found no column that names them",
            where=foreign.name,
            hint="name their folder with --images DIR",
        )
    folder = Path(options.images)
    names = [name for name in list_folder(folder) if is_image(name)]
    if not names:
        raise InputError("expected a folder of images, found none in it", where=options.images)
    _require_own_stems(names, options.images)
    return [picture(str(folder / name), options, foreign.place) for name in names]


def _require_own_stems(names: list[str], folder: str) -> None:
    first: dict[str, str] = {}
    for name in names:
        other = first.setdefault(Path(name).stem, name)
        if other != name:
            raise InputError(
                f"expected one image of each name, found {other} and {name}", where=folder
            )


def _unused(pairs: Pairs, images: list[ImageFile]) -> tuple[Finding, ...]:
    if not pairs.lone:
        return ()
    named = first_few([image.label for image in pairs.lone], _NAMED)
    message = (
        f"{len(pairs.lone)} of {len(images)} images have no pose in the table and are left out: "
        f"{named}"
    )
    return (Finding("images-without-pose", "warning", message, "see whether poses are missing"),)
