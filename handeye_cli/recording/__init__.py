"""Recorded robot data: images, intrinsics and poses, streamed out of MCAP files.

    framing -> chunks -> container -> decoding -> survey -> selection -> pauses, moving -> stations

`several_files` and `bag_folder` say which files there are, `container` finds the messages in them,
with the help of `framing`, `chunks`, `channels` and `file_index`, `decoding` turns payloads into
our messages (`message_table` and `decoders/` say which), `survey` makes the one pass, in which
`known_links` reads what differs from before in its numbers only, and `stations` puts a `Recording`
together. Nothing heavy is imported before a recording is really read.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye_cli.lazily import loader

if TYPE_CHECKING:
    from handeye_cli.recording.options import McapOptions, PauseThresholds
    from handeye_cli.recording.several_files import Paths
    from handeye_cli.recording.summary import Looked
    from handeye_cli.records import Recording

__all__ = [
    "McapOptions",
    "PauseThresholds",
    "files_of",
    "is_recording",
    "look",
    "read",
]

__getattr__ = loader(__name__, {f"{__name__}.options": ("McapOptions", "PauseThresholds")})

_MAGIC = b"\x89MCAP0\r\n"
_ENDINGS = (".mcap", ".mcap.zstd", ".mcap.zst", ".db3", ".bag")
"""Of recordings, some of which can only be named and not be read."""


def is_recording(path: str) -> bool:
    """Return whether a path is a robot's recording: by its ending, by its first bytes, or a folder.

    Pipes and devices are not looked into: what is read from them is gone.

    Args:
        path: A path; it need not exist or be readable. `-` is never one: a recording is not read
            in one go, so it cannot come from a pipe.
    """
    if path == "-":
        return False
    if path.endswith(_ENDINGS):
        return True
    try:
        if Path(path).is_dir():
            return True
        if not Path(path).is_file():
            return False
        with Path(path).open("rb") as stream:
            return stream.read(len(_MAGIC)) == _MAGIC
    except (OSError, ValueError):
        return False


def files_of(path: Paths) -> tuple[str, ...]:
    """Return the files of a recording in their order: itself, those in its folder, or those named.

    Raises:
        InputError: It is a folder that cannot be read or has no MCAP files.
        UsageError: A file is named twice.
    """
    from handeye_cli.recording import several_files

    return several_files.files_of(path).paths


def read(path: Paths, options: McapOptions) -> Recording:
    """Return the stations of an MCAP recording: one for every pause of the robot with an image.

    Of a robot that hardly pauses, and on demand, the stations are frames along its way.

    Args:
        path: The MCAP file, the folder of a rosbag2 recording, all of whose files are read, or
            several of these that are one recording.
        options: What the recording cannot say, and choices where it says more than one thing.

    Raises:
        InputError: A file is no MCAP; the recording lacks images, poses or pauses, or what is not
            damaged in it does; or a choice is ambiguous, and the message lists what there is.
        UsageError: Options contradict each other.
    """
    from handeye_cli.recording import stations

    return stations.read(path, options)


def look(path: Paths, options: McapOptions, flags: Mapping[str, Any]) -> Looked:
    """Look into an MCAP recording, and read it where nothing is in the way of that.

    What stops `read`, such as an ambiguous choice, is an error of the diagnosis here. The files are
    gone through once.

    Args:
        path: The MCAP file, a folder, or several of these.
        options: What the file cannot say, and choices where it says more than one thing.
        flags: The same as they were given on the command line, by name without dashes.

    Raises:
        InputError: The file cannot be opened or is no MCAP.
        UsageError: Options contradict each other.
    """
    from handeye_cli.recording import summary

    return summary.look(path, options, flags)
