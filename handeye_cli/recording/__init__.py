"""Recorded robot data: images, intrinsics and poses, streamed out of an MCAP file.

    container -> decoding -> survey -> selection -> pauses -> stations

`container` frames the file, `decoding` turns payloads into our messages (`message_table` and
`decoders/` say which), `survey` makes the one pass, and `stations` puts a `Recording` together.
Nothing heavy is imported before a recording is really read.
"""

from __future__ import annotations

from pathlib import Path

from handeye_cli.recording.options import McapOptions, PauseThresholds
from handeye_cli.records import Recording

__all__ = ["McapOptions", "PauseThresholds", "is_recording", "read"]

_MAGIC = b"\x89MCAP0\r\n"


def is_recording(path: str) -> bool:
    """Return whether a path is an MCAP recording, by its ending or by its first bytes.

    Pipes and devices are not looked into: what is read from them is gone.

    Args:
        path: A file's path; it need not exist or be readable. `-` is never one: a recording is
            not read in one go, so it cannot come from a pipe.
    """
    if path == "-":
        return False
    if path.endswith(".mcap"):
        return True
    try:
        if not Path(path).is_file():
            return False
        with Path(path).open("rb") as stream:
            return stream.read(len(_MAGIC)) == _MAGIC
    except (OSError, ValueError):
        return False


def read(path: str, options: McapOptions) -> Recording:
    """Return the stations of an MCAP recording: one for every pause of the robot with an image.

    Args:
        path: The MCAP file.
        options: What the file cannot say, and choices where it says more than one thing.

    Raises:
        InputError: The file is no MCAP, is damaged, or lacks images, poses or pauses; or a choice
            is ambiguous, and the message lists what there is.
        UsageError: Options contradict each other.
    """
    from handeye_cli.recording import stations

    return stations.read(path, options)
