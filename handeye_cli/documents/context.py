"""What reading a document takes beside its text: the user's flags, and where it lies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions
from handeye_cli.errors import InputError


@dataclass(frozen=True)
class ReadOptions:
    """Facts the user states on the command line; each wins over the document.

    Attributes:
        setup: Where the camera is fixed.
        pose_units: Unit of the document's translations.
        quaternion_order: Order of its quaternions.
        robot_poses: Direction of its robot poses.
        allow_outside: Whether images may lie outside the document's folder.
    """

    setup: Setup | None = None
    pose_units: PoseUnits | None = None
    quaternion_order: QuaternionOrder | None = None
    robot_poses: RobotPoses | None = None
    allow_outside: bool = False


NO_FLAGS = ReadOptions()
"""The document alone says how it is to be read."""


@dataclass(frozen=True)
class Context:
    """What holds for a whole document while it is read.

    Attributes:
        place: The document itself.
        folder: The folder its relative paths start from.
        declared: Where the camera is fixed, or None where neither document nor flag says it.
        poses: How its poses are written.
        allow_outside: Whether images may lie outside `folder`.
    """

    place: Place
    folder: Path
    declared: Setup | None
    poses: PoseConventions
    allow_outside: bool = False

    @property
    def setup(self) -> Setup:
        """Where the camera is fixed.

        Raises:
            InputError: Neither the document nor a flag says it.
        """
        if self.declared is None:
            raise InputError(
                "expected the key 'setup', found none",
                where=self.place.file,
                hint="say where the camera is with --setup eye-in-hand|eye-to-hand",
            )
        return self.declared


def context_of(data: dict[str, Any], options: ReadOptions, label: str, folder: Path) -> Context:
    """Return what holds for a document: flag over file over default.

    Args:
        data: The document's plain data, valid under its schema.
        options: The user's flags.
        label: Name of the document for error messages.
        folder: The folder its relative paths start from.
    """
    setup = options.setup or data.get("setup")
    declared = None if setup is None else Setup(setup)
    conventions = PoseConventions(
        PoseUnits(options.pose_units or data.get("pose_units", PoseUnits.M)),
        QuaternionOrder(
            options.quaternion_order or data.get("quaternion_order", QuaternionOrder.XYZW)
        ),
        RobotPoses(options.robot_poses or data.get("robot_poses", RobotPoses.GRIPPER_IN_BASE)),
    )
    return Context(Place(label), folder, declared, conventions, options.allow_outside)
