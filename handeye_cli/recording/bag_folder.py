"""The files a recording consists of: one, or those of a rosbag2 folder in their order.

rosbag2 splits a long recording, names the files in `metadata.yaml` once it has ended well, and
writes /tf_static into the first of them only. So all of them are one recording.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from handeye_cli.errors import InputError
from handeye_cli.recording import findings
from handeye_cli.records import Finding

_METADATA = "metadata.yaml"
_MAX_METADATA_BYTES = 2**24
_MAX_VALUES = 200_000
"""Most values in a metadata.yaml: each takes a hundred times its bytes in memory."""
_MAX_DEPTH = 60
"""Deepest nesting in it: the parser would leave its stack."""
_LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""Every value stays text: no number is computed, no merge key unfolds into many others."""
_STORAGE = "mcap"
_PACKED = (".zstd", ".zst")


@dataclass(frozen=True)
class BagFiles:
    """The files of a recording.

    Attributes:
        paths: Their paths in order, at least one.
        findings: What the user should know about them.
    """

    paths: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def files_of(path: str) -> BagFiles:
    """Return the files of a recording.

    Without a `metadata.yaml`, which a recording that was interrupted does not have, the files of a
    folder are in the order of their names, numbers in them counting as numbers.

    Args:
        path: A file, which is not looked into, or a folder.

    Raises:
        InputError: The folder cannot be read, holds no MCAP file, or is a rosbag2 recording in
            another storage or compressed.
    """
    folder = Path(path)
    if not folder.is_dir():
        return BagFiles((path,))
    try:
        present = {each.name for each in folder.iterdir() if not each.is_dir()}
        listed = _listed(folder / _METADATA) if _METADATA in present else None
    except OSError as fault:
        raise InputError(f"cannot read it: {fault.strerror}", where=path) from fault
    wanted = listed or sorted(
        (name for name in present if name.endswith(".mcap")), key=_with_numbers
    )
    names = [_unpacked_name(name, present) for name in wanted]
    names = [name for name in names if name in present]
    for name in names or sorted(present):
        _refuse_foreign(folder / name)
    if not names:
        raise _nothing_in(path, present, listed)
    found = [findings.files(names)] if len(names) > 1 else []
    missing = [name for name in wanted if _unpacked_name(name, present) not in present]
    if missing:
        found.append(findings.files_missing(missing))
    return BagFiles(tuple(str(folder / name) for name in names), tuple(found))


def _listed(path: Path) -> list[str]:
    """Return the names of the files in a metadata.yaml; folders before them are left out."""
    information = _parsed(path)
    storage = information.get("storage_identifier", _STORAGE)
    if storage != _STORAGE:
        raise _foreign_storage(f"storage {_described(storage)}", str(path))
    listed = information.get("relative_file_paths")
    if not isinstance(listed, list) or not all(isinstance(each, str) for each in listed):
        raise InputError(
            f"expected a list of files in relative_file_paths, found {_described(listed)}",
            where=str(path),
            hint="without this file, the folder's .mcap files are read in the order of their names",
        )
    return list(dict.fromkeys(Path(each).name for each in listed))


def _parsed(path: Path) -> Mapping[str, Any]:
    if not path.is_file():
        message = "expected the metadata of a rosbag2 recording, found a device or pipe"
        raise InputError(message, where=str(path))
    with path.open("rb") as file:
        raw = file.read(_MAX_METADATA_BYTES)
    try:
        _require_small(raw)
        document = yaml.load(raw, _LOADER)
        information = document["rosbag2_bagfile_information"]
        if isinstance(information, Mapping):
            return information
        reason = f"found {_described(information)}"
    except (yaml.YAMLError, UnicodeDecodeError, LookupError, TypeError, ValueError) as fault:
        reason = f"found {type(fault).__name__}: {' '.join(str(fault).split())}"
    raise InputError(
        f"expected the metadata of a rosbag2 recording, {reason}",
        where=str(path),
        hint="without this file, the folder's .mcap files are read in the order of their names",
    )


def _require_small(raw: bytes) -> None:
    """Check that what a text unfolds to is little and not nested deeply, as metadata are.

    Raises:
        ValueError: It is not.
        YAMLError: It is no YAML.
    """
    depth = 0
    for count, event in enumerate(yaml.parse(raw, _LOADER)):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MAX_DEPTH:
            raise ValueError(f"more than {_MAX_DEPTH} levels of nesting")
        if count > _MAX_VALUES:
            raise ValueError(f"more than {_MAX_VALUES} values")


def _described(value: Any) -> str:
    """Return what was found; of lists and mappings, which can be endless in YAML, only the kind."""
    return type(value).__name__ if isinstance(value, list | Mapping) else repr(value)[:80]


def _with_numbers(name: str) -> list[tuple[int, str]]:
    """Return a key by which names sort as people count: bag_2 comes before bag_10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def _unpacked_name(name: str, present: set[str]) -> str:
    """Return the name of a file, or what it is called after it was unpacked by hand."""
    for ending in _PACKED:
        plain = name.removesuffix(ending)
        if name not in present and plain in present:
            return plain
    return name


def _refuse_foreign(path: Path) -> None:
    if path.name.endswith((".mcap.zstd", ".mcap.zst")):
        raise InputError(
            "expected an MCAP recording, found one that is compressed as a whole",
            where=str(path),
            hint=f"unpack it with `zstd -d {path}`, and all others of its folder",
        )
    if path.name.endswith(".db3"):
        raise _foreign_storage("a file of SQLite", str(path))


def _foreign_storage(found: str, where: str) -> InputError:
    return InputError(
        f"expected a recording in MCAP, found {found}",
        where=where,
        hint="convert it with `ros2 bag convert` to storage_id mcap",
    )


def _nothing_in(path: str, present: set[str], listed: list[str] | None) -> InputError:
    documents = sorted(name for name in present if name.endswith((".yaml", ".json")))
    if listed:
        found = "none of those that its metadata.yaml names: " + ", ".join(listed[:5])
    else:
        found = "none in " + (", ".join(sorted(present)[:5]) or "an empty folder")
    hint = "give the folder that `ros2 bag record` has made, or a file in it"
    if documents and not listed:
        hint = f"give the document in it: {Path(path) / documents[0]}"
    return InputError(f"expected MCAP files in a folder, found {found}", where=path, hint=hint)
