"""A pose that a user states: seven numbers with commas, or a small file with one pose."""

from __future__ import annotations

import re
from typing import Any

from handeye_cli.documents import files, schema, text
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions, pose_from_data
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import FloatArray

_NUMBER = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"
_INLINE = re.compile(rf"{_NUMBER}(?:,{_NUMBER})+")


def read_pose_guess(source: str) -> FloatArray | None:
    """Return the (4, 4) pose that a text or a file states, or None where the file is a document.

    Args:
        source: `x,y,z,qx,qy,qz,qw` in metres; or a YAML or JSON file that holds one pose, in any
            form that a pose has in a document.

    Raises:
        UsageError: There are not seven numbers.
        InputError: It is no pose, or the file cannot be read.
    """
    pose = pose_of_numbers(source)
    return pose_in(files.read_bytes(source), source) if pose is None else pose


def pose_of_numbers(source: str) -> FloatArray | None:
    """Return the (4, 4) pose of `x,y,z,qx,qy,qz,qw` in metres, or None where it is no such list.

    Raises:
        UsageError: There are not seven numbers.
        InputError: They are no pose.
    """
    if not _INLINE.fullmatch(source):
        return None
    numbers = [float(word) for word in source.split(",")]
    if len(numbers) != 7:
        raise UsageError(
            f"expected seven numbers, found {len(numbers)}: {source}",
            hint="write the pose as x,y,z,qx,qy,qz,qw in metres",
        )
    return _pose({"translation": numbers[:3], "quaternion": numbers[3:]}, source)


def pose_in(content: bytes, source: str) -> FloatArray | None:
    """Return the (4, 4) pose that a file's bytes hold, or None where they are a document.

    Raises:
        InputError: They are no pose.
    """
    data = text.parse(content, files.label_of(source))
    if isinstance(data, dict) and "schema" in data:
        return None
    schema.validate(data, "pose", source)
    return _pose(data, source)


def read_stated_pose(flag: str, source: str) -> FloatArray:
    """Return the (4, 4) pose that the text or the file of a flag states.

    Args:
        flag: Such as `--base-T-target`.
        source: As for `read_pose_guess`.

    Raises:
        UsageError: There are not seven numbers.
        InputError: It is no pose but a document, or the file cannot be read.
    """
    pose = read_pose_guess(source)
    if pose is None:
        raise InputError(
            f"expected {flag} to be a pose, found a document",
            where=source,
            hint="write x,y,z,qx,qy,qz,qw, or a file with translation and quaternion",
        )
    return pose


def _pose(data: dict[str, Any], label: str) -> FloatArray:
    return pose_from_data(data, PoseConventions(), Place(label)).matrix
