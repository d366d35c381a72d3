"""Data sets of other tools as recordings and stations of ours.

A kind of file is a module and a row in the table below. Its `recognises` says whether a file is of
this kind, by keys or names that no other kind has; `read` makes a record of it. What a kind's poses
mean - direction, units, who knows where the camera is fixed - its module says at its top.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Protocol, cast

from handeye_cli.documents.complaints import describe
from handeye_cli.documents.imports.foreign import Foreign, Imported, ImportOptions
from handeye_cli.errors import InputError, UsageError, did_you_mean
from handeye_cli.records import Recording, Stations

__all__ = ["KINDS", "ImportOptions", "Imported", "detect", "read"]


@dataclass(frozen=True)
class Kind:
    """A row of the table.

    Attributes:
        module: What reads it.
        what: What it is, for people.
        options: Options beyond the common ones that act on it.
    """

    module: str
    what: str
    options: frozenset[str] = frozenset()


_ROOM = "handeye_cli.documents.imports"
KINDS = {
    "easy-handeye": Kind(f"{_ROOM}.easy_handeye", "samples of easy_handeye or easy_handeye2"),
    "moveit": Kind(f"{_ROOM}.moveit", "samples of MoveIt Calibration"),
    "industrial-calibration": Kind(
        f"{_ROOM}.industrial_calibration",
        "cal_data.yaml of industrial_calibration or robot_cal_tools",
    ),
    "visp": Kind(f"{_ROOM}.visp", "a folder with ViSP's pose_rPe_1.yaml, ..."),
    "opencv": Kind(f"{_ROOM}.opencv", "lists called as the arguments of OpenCV's calibrateHandEye"),
    "trajectory": Kind(
        f"{_ROOM}.trajectory",
        "a CSV or TUM table of robot poses",
        frozenset(("images", "rotation", "quaternion_order")),
    ),
}
"""Every kind of data that is read, by the name that `--from` takes."""

_OWN = "schema"
_STRUCTURED = (".yaml", ".yml", ".json", ".samples")


class _Reader(Protocol):
    """What the module of a kind offers."""

    def recognises(self, foreign: Foreign) -> bool: ...

    def read(self, foreign: Foreign, options: ImportOptions) -> Recording | Stations: ...


def read(path: str, options: ImportOptions, kind: str | None = None) -> Imported:
    """Return the record of a file or folder of another tool.

    Args:
        path: The file or folder.
        options: What the user says beside it.
        kind: A row of `KINDS`; found out when None.

    Raises:
        InputError: It cannot be read, is of no known kind or broken, or lacks what only the user
            can say.
        UsageError: The kind is unknown, or an option cannot act on it.
    """
    foreign = Foreign(path)
    name = detect(foreign) if kind is None else _known(kind)
    _refuse_idle(options, name)
    record = _reader(name).read(foreign, options)
    _require_facts(record, options, foreign)
    return Imported(name, record, foreign.files)


def detect(foreign: Foreign) -> str:
    """Return the kind of a file or folder.

    Raises:
        InputError: It is of none, or could be of several.
    """
    found = [name for name in KINDS if _reader(name).recognises(foreign)]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(
            f"expected a file of one kind, found what may be {' or '.join(found)}",
            where=foreign.name,
            hint=f"say which with --from {found[0]}",
        )
    raise _unrecognised(foreign)


def _unrecognised(foreign: Foreign) -> InputError:
    data = foreign.data
    if isinstance(data, dict) and _OWN in data:
        return InputError(
            "expected a file of another tool, found a document with a line schema: "
            f"{describe(data[_OWN])}",
            where=foreign.name,
            hint="ours need no import: every command takes them as they are",
        )
    if data is None and foreign.path.suffix.lower() in _STRUCTURED:
        # the text itself is broken, and says where
        foreign.parse(foreign.name)
    listed = "; ".join(f"{name} - {kind.what}" for name, kind in KINDS.items())
    return InputError(
        f"expected a file of a known kind, found {_found(foreign)}",
        where=foreign.name,
        hint=f"with --from KIND the error tells what is missing in it: {listed}",
    )


def _found(foreign: Foreign) -> str:
    if foreign.is_folder:
        return f"a folder with {len(foreign.entries)} files"
    return describe(foreign.data) if foreign.data is not None else f"{len(foreign.content)} bytes"


def _known(kind: str) -> str:
    if kind not in KINDS:
        near = did_you_mean(kind, list(KINDS))
        raise UsageError(
            f"expected one of {', '.join(KINDS)}, found {kind!r}",
            where="--from",
            hint=f"did you mean {near}?" if near else None,
        )
    return kind


def _reader(name: str) -> _Reader:
    return cast(_Reader, import_module(KINDS[name].module))


def _refuse_idle(options: ImportOptions, name: str) -> None:
    for option in sorted({each for kind in KINDS.values() for each in kind.options}):
        if getattr(options, option) is not None and option not in KINDS[name].options:
            able = next(kind.what for kind in KINDS.values() if option in kind.options)
            flag = f"--{option.replace('_', '-')}"
            raise UsageError(
                f"{flag} acts on {able} only, and this is {KINDS[name].what}",
                hint="leave the flag out, or say what is meant with --from",
            )


def _require_facts(record: Recording | Stations, options: ImportOptions, foreign: Foreign) -> None:
    if not isinstance(record, Recording):
        return
    if record.target is None:
        raise InputError(
            "expected to learn what the target is, found nothing that says so",
            where=foreign.name,
            hint="say it with --target, such as chessboard:9x6:23.6mm or charuco:5x7:36mm:18mm:"
            "DICT_6X6_250",
        )
    if record.camera is None and not options.own_camera:
        raise InputError(
            "expected the camera's intrinsics, found none",
            where=foreign.name,
            hint="name their file with --camera FILE, or say --no-camera and let solve estimate "
            "them with --calibrate-intrinsics",
        )
