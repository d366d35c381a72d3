"""The frames of an export: their names, and the step from the optical frame to the mount link."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import NoReturn

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.records import Calibration, FloatArray, ProvenanceStep
from handeye_cli.records.named_transform import NamedTransform

_FRAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_./-]*")
"""Names that no shell, launch file or YAML reader takes for something else."""
_CAMERA = "camera"
_MOUNT_FLAGS = {Setup.EYE_IN_HAND: "gripper-frame", Setup.EYE_TO_HAND: "base-frame"}
_EXAMPLES = {Setup.EYE_IN_HAND: "tool0", Setup.EYE_TO_HAND: "base_link"}


def check_names(
    *, parent: str | None, child: str | None, mount_frame: str | None, required: bool
) -> None:
    """Refuse names that no calibration could make good, before one is computed.

    Args:
        parent: Name of the frame the camera is fixed to, or None.
        child: Name of the camera's optical frame, or None.
        mount_frame: Name of its mount link, or None.
        required: Whether the file needs names.

    Raises:
        UsageError: One is no name of a frame, or that of the optical frame is missing.
    """
    flags = {"--parent": parent, "--child": child, "--mount-frame": mount_frame}
    for flag, name in flags.items():
        if name is not None:
            _frame(name, flag)
    if required and child is None:
        _missing("child", "the camera's optical frame", "camera_optical_frame")


def named(
    calibration: Calibration,
    *,
    parent: str | None,
    child: str | None,
    required: bool,
    name: str = "handeye",
) -> NamedTransform:
    """Return the answer of a calibration between two named frames.

    Args:
        calibration: Its `mount_T_camera` is the pose.
        parent: Name of the gripper's frame, or for eye-to-hand of the base's; what the calibration
            remembers of its recording when None.
        child: Name of the camera's optical frame.
        required: Whether names must be known; where not, our own stand in for them.
        name: What the calibration is filed under.

    Raises:
        UsageError: A name is missing or none of a frame, or both are the same.
    """
    check_names(parent=parent, child=child, mount_frame=None, required=required)
    setup = calibration.setup
    parent = parent or _remembered(calibration.provenance, _MOUNT_FLAGS[setup])
    if required and parent is None:
        _missing("parent", f"the {setup.mount}", _EXAMPLES[setup])
    pose = calibration.mount_T_camera
    transform = NamedTransform(
        parent=_frame(parent or setup.mount, "--parent"),
        child=child or _CAMERA,
        matrix=pose.matrix,
        setup=setup,
        covariance=pose.covariance,
        camera=calibration.camera,
        name=name,
    )
    return _of_two_frames(transform, "--child")


def at_mount(
    transform: NamedTransform, mount_frame: str, mount_T_optical: FloatArray
) -> NamedTransform:
    """Return the pose of a camera's mount link instead of that of its optical frame.

    Args:
        transform: Its child is the optical frame.
        mount_frame: Name of the mount link, such as `camera_link`.
        mount_T_optical: (4, 4) pose of the optical frame in the mount link, taken as exact.

    Returns:
        `parent_T_mount = parent_T_optical @ inverse(mount_T_optical)`, without intrinsics.

    Raises:
        UsageError: The link has no proper name, or that of the parent.
    """
    optical_T_mount = se3.inverse(mount_T_optical)
    covariance = transform.covariance
    if covariance is not None:
        J, _ = se3.compose_jacobians(transform.matrix, optical_T_mount)
        covariance = J @ covariance @ J.T
    moved = replace(
        transform,
        child=_frame(mount_frame, "--mount-frame"),
        matrix=transform.matrix @ optical_T_mount,
        covariance=covariance,
        camera=None,
        optical=False,
    )
    return _of_two_frames(moved, "--mount-frame")


def _remembered(steps: Iterable[ProvenanceStep], flag: str) -> str | None:
    """Return the frame that a flag named on the way to the calibration."""
    found = [str(step.options[flag]) for step in steps if flag in step.options]
    return found[-1].removeprefix("/") if found else None


def _missing(role: str, of: str, example: str) -> NoReturn:
    raise UsageError(
        f"expected the name of the {role} frame, that of {of}, found none",
        hint=f"name it as TF does: --{role} {example}",
    )


def _frame(name: str, flag: str) -> str:
    if not _FRAME.fullmatch(name):
        raise UsageError(
            f"expected {flag} to be the name of a frame, found {name!r}",
            hint="letters, digits and _ . / - only; tf2 knows no names that start with a slash",
        )
    return name


def _of_two_frames(transform: NamedTransform, flag: str) -> NamedTransform:
    if transform.parent == transform.child:
        raise UsageError(
            f"expected {flag} to differ from the parent, found {transform.child!r} for both",
            hint="a frame has no pose in itself",
        )
    return transform
