"""Where the optical frame lies in its camera's mount link: stated, or looked up in TF."""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.cli.export_options import Frames
from handeye_cli.cli.options import Source
from handeye_cli.errors import InputError, UsageError
from handeye_cli.wording import first_few

if TYPE_CHECKING:
    from handeye_cli.records import FloatArray


def mount_pose(frames: Frames, source: Source) -> FloatArray | None:
    """Return the (4, 4) pose of the optical frame in the mount link, or None without a link.

    Args:
        frames: Flags about the frames.
        source: The command's input, whose TF, in all its files, is looked into where no pose is
            given.

    Raises:
        UsageError: A flag is given without the one it needs, or the pose is not seven numbers.
        InputError: The pose cannot be read or is none, or TF does not have it.
    """
    from handeye_cli import recording

    stated = frames.mount_T_optical
    if frames.mount_frame is None:
        if stated is not None:
            raise UsageError(
                f"expected --mount-frame beside --mount-T-optical {stated}, found none",
                hint="name the link, such as --mount-frame camera_link",
            )
        return None
    if stated is not None and not recording.is_recording(stated):
        from handeye_cli.documents.pose_guess import read_stated_pose

        return read_stated_pose("--mount-T-optical", stated)
    paths = source.paths if stated is None else (stated,)
    for path in paths:
        if not recording.is_recording(path):
            raise UsageError(
                f"expected the optical frame's pose in {frames.mount_frame!r}, and {path} has no "
                "TF",
                hint="give it with --mount-T-optical: a recording with TF, a file or seven numbers",
            )
    return _pose_from_tf(paths, frames.mount_frame, frames.child)


def _pose_from_tf(paths: tuple[str, ...], mount_frame: str, child: str | None) -> FloatArray:
    from handeye_cli.recording import fixed_frames

    if child is None:
        raise UsageError(
            "expected the name of the optical frame, which is looked up in TF, found none",
            hint="name it with --child, such as --child camera_optical_frame",
        )
    first, *further = paths
    try:
        return fixed_frames.read(
            paths if further else first, mount_frame, child, ("--mount-frame", "--child")
        )
    except InputError as error:
        name = first_few(paths, 1)
        error.where = name if error.where in (None, first) else f"{name}: {error.where}"
        raise
