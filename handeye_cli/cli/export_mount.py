"""Where the optical frame lies in its camera's mount link: stated, or looked up in TF."""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.cli.export_options import Frames
from handeye_cli.errors import InputError, UsageError

if TYPE_CHECKING:
    from handeye_cli.records import FloatArray


def mount_pose(frames: Frames, source: str) -> FloatArray | None:
    """Return the (4, 4) pose of the optical frame in the mount link, or None without a link.

    Args:
        frames: Flags about the frames.
        source: The command's input, whose TF is looked into where no pose is given.

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
    if stated is None and not recording.is_recording(source):
        raise UsageError(
            f"expected the optical frame's pose in {frames.mount_frame!r}, and {source} has no TF",
            hint="give it with --mount-T-optical: a recording with TF, a file or seven numbers",
        )
    where = stated or source
    if recording.is_recording(where):
        return _pose_from_tf(where, frames.mount_frame, frames.child)
    return _pose_as_stated(where)


def _pose_from_tf(path: str, mount_frame: str, child: str | None) -> FloatArray:
    from handeye_cli.recording import fixed_frames

    if child is None:
        raise UsageError(
            "expected the name of the optical frame, which is looked up in TF, found none",
            hint="name it with --child, such as --child camera_optical_frame",
        )
    try:
        return fixed_frames.read(path, mount_frame, child, ("--mount-frame", "--child"))
    except InputError as error:
        error.where = path if error.where in (None, path) else f"{path}: {error.where}"
        raise


def _pose_as_stated(text: str) -> FloatArray:
    from handeye_cli.documents.pose_guess import read_pose_guess

    pose = read_pose_guess(text)
    if pose is None:
        raise InputError(
            "expected --mount-T-optical to be a pose, found a document",
            where=text,
            hint="write x,y,z,qx,qy,qz,qw, or a file with translation and quaternion",
        )
    return pose
