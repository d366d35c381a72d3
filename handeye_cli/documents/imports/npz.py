"""Arrays of NumPy's NPZ files, which are zip archives: nothing in them is ever executed."""

from __future__ import annotations

import io
import struct
import textwrap
import zipfile
import zlib
from typing import Any

import numpy as np

from handeye_cli.errors import InputError

MAX_BYTES = 32_000_000
"""Most bytes of arrays that are read: as lists of numbers they take five times as much."""
_MAGIC = b"PK\x03\x04"
_FAULTS = (
    ValueError,  # no number type, a shape that the bytes do not fill, objects that need pickle
    OSError,
    EOFError,
    KeyError,
    RuntimeError,  # an unknown compression, or a password
    MemoryError,  # a shape beyond all bounds
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
"""What NumPy and the standard library raise when an archive is broken."""
_LONGEST = 120
"""Characters of a reason that are shown: some quote the archive."""


def is_npz(content: bytes) -> bool:
    """Return whether bytes start like a zip archive."""
    return content.startswith(_MAGIC)


def arrays_of(content: bytes, label: str) -> dict[str, Any]:
    """Return the arrays of a file as nested lists, by their names.

    Args:
        content: The bytes of the file.
        label: Its name for error messages.

    Raises:
        InputError: It is broken or too large, or has arrays of other things than numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(each.file_size for each in archive.infolist())
        if size > MAX_BYTES:
            message = f"expected at most {MAX_BYTES // 1_000_000} MB of arrays, found {size:.3g} B"
            raise InputError(message, where=label)
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {key: np.asarray(arrays[key]).tolist() for key in arrays.files}
    except _FAULTS as error:
        raise InputError(
            f"expected an NPZ file of numbers: {textwrap.shorten(str(error), _LONGEST)}",
            where=label,
            hint="save lists of arrays as one array: np.savez(file, R_gripper2base=np.array(...))",
        ) from error
