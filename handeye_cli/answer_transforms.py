"""The answer as transforms between named frames, as robots publish them."""

from __future__ import annotations

from collections.abc import Mapping

from handeye_cli.conventions import MM, MRAD, Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations
from handeye_cli.recording.messages import Header, TransformStamped
from handeye_cli.recording.transforms import plain_name
from handeye_cli.records import Calibration, FloatArray
from handeye_cli.records.frames import RobotFrames

UNNAMED = RobotFrames(base="base", gripper="gripper", camera="camera_optical")
"""Names for what has none."""
TARGET = "target"


def answer_transforms(
    calibration: Calibration,
    frames: RobotFrames | None = None,
    *,
    parent: str | None = None,
    child: str | None = None,
) -> tuple[TransformStamped, TransformStamped]:
    """Return the camera in its mount and the target in its reference as stamped transforms.

    The mount is the gripper and the reference the base, or the other way round for eye-to-hand. The
    target's frame is named `target`.

    Args:
        calibration: The answer.
        frames: Names from a recording, and the time of the transforms; `base`, `gripper`,
            `camera_optical` and 0 where it does not say them.
        parent: Name of the mount that wins over the recording's.
        child: Name of the camera that wins over the recording's.

    Raises:
        UsageError: Two frames would have the same name.
    """
    known = frames or UNNAMED
    base, gripper = known.base or UNNAMED.base, known.gripper or UNNAMED.gripper
    in_hand = calibration.setup is Setup.EYE_IN_HAND
    mount, reference = (gripper, base) if in_hand else (base, gripper)
    mount = plain_name(mount if parent is None else parent)
    camera = plain_name((known.camera or UNNAMED.camera) if child is None else child)
    _require_names(mount, reference, camera, TARGET)
    stamp = known.start_ns
    return (
        _stamped(Header(stamp, mount), camera, calibration.mount_T_camera.matrix),
        _stamped(Header(stamp, reference), TARGET, calibration.reference_T_target.matrix),
    )


def notes_of(calibration: Calibration) -> Mapping[str, str]:
    """Return what should stay with the transforms, for people: how they were found, how sure."""
    error = calibration.predicted_error
    return {
        "setup": str(calibration.setup),
        "method": calibration.method,
        "predicted_rotation_mrad": f"{error.rotation / MRAD:.4g}",
        "predicted_translation_mm": f"{error.translation / MM:.4g}",
    }


def _require_names(*names: str) -> None:
    if len(set(names)) < len(names) or "" in names:
        raise UsageError(
            f"expected different names of the frames, found {', '.join(map(repr, names))}",
            hint="name the mount and the camera with --parent-frame and --child-frame",
        )


def _stamped(header: Header, child: str, parent_T_child: FloatArray) -> TransformStamped:
    x, y, z = parent_T_child[:3, 3].tolist()
    qx, qy, qz, qw = rotations.quaternion_from_matrix(parent_T_child[:3, :3]).tolist()
    return TransformStamped(header, child, (x, y, z), (qx, qy, qz, qw))
