"""What the user named: a file or folder of another tool, its options, and what becomes of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup
from handeye_cli.documents import files, text
from handeye_cli.documents.cameras import file_storage
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions
from handeye_cli.errors import InputError
from handeye_cli.records import Recording, Stations, TargetSpec


@dataclass(frozen=True)
class ImportOptions:
    """What the user says beside the path; each flag wins over the file.

    Attributes:
        setup: Where the camera is fixed.
        target: What the camera looks at.
        pose_units: Unit of the file's translations.
        quaternion_order: Order of quaternions whose numbers have no names.
        robot_poses: Direction of the file's robot poses.
        images: Folder of the images that belong to a table of poses.
        rotation: What three angles of a table are, such as `rotvec` or `ZYX:deg`.
        folder: The folder that image paths of the new document start from.
        allow_outside: Whether images may lie outside that folder.
        own_camera: Whether the intrinsics come from elsewhere, or are to be estimated.
    """

    setup: Setup | None = None
    target: TargetSpec | None = None
    pose_units: PoseUnits | None = None
    quaternion_order: QuaternionOrder | None = None
    robot_poses: RobotPoses | None = None
    images: str | None = None
    rotation: str | None = None
    folder: Path = field(default_factory=Path)
    allow_outside: bool = False
    own_camera: bool = False

    def conventions(self, told: RobotPoses = RobotPoses.GRIPPER_IN_BASE) -> PoseConventions:
        """Return how poses are written.

        Args:
            told: Direction of the robot's poses as the kind of file has them.
        """
        return PoseConventions(
            self.pose_units or PoseUnits.M,
            self.quaternion_order or QuaternionOrder.XYZW,
            self.robot_poses or told,
        )

    def known_setup(self, told: Setup | None, place: Place) -> Setup:
        """Return where the camera is fixed.

        Args:
            told: What the file says of it, or None.
            place: The file.

        Raises:
            InputError: Neither the file nor a flag says it.
        """
        setup = self.setup or told
        if setup is None:
            raise InputError(
                "expected to learn where the camera is fixed, found nothing that says so",
                where=str(place),
                hint="say it with --setup eye-in-hand|eye-to-hand",
            )
        return setup


@dataclass(frozen=True)
class Imported:
    """A record made from the files of another tool.

    Attributes:
        kind: The row of `KINDS` that read them.
        record: What they hold.
        files: Pairs of name and SHA-256 in hex of every file that was read.
    """

    kind: str
    record: Recording | Stations
    files: tuple[tuple[str, str], ...]


class Foreign:
    """A file or folder of another tool; remembers what was read of it, for the provenance.

    Args:
        name: The path as the user gave it.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.path = Path(name)
        self._digests: dict[str, str] = {}

    @property
    def place(self) -> Place:
        """The file or folder as the place of what is wrong with it."""
        return Place(self.name)

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Name and SHA-256 of every file read so far."""
        return tuple(self._digests.items())

    @cached_property
    def is_folder(self) -> bool:
        """Whether it is a folder.

        Raises:
            InputError: It can be no name of a file.
        """
        try:
            return self.path.is_dir()
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            message = f"expected a readable file or folder: {reason}"
            raise InputError(message, where=self.name) from error

    @cached_property
    def entries(self) -> tuple[str, ...]:
        """Names of the files in the folder, sorted; none where it is no folder."""
        return list_folder(self.path) if self.is_folder else ()

    @cached_property
    def content(self) -> bytes:
        """Bytes of the file; none of a folder.

        Raises:
            InputError: It cannot be read.
        """
        return b"" if self.is_folder else self.read(self.name)

    @cached_property
    def data(self) -> Any:
        """The file's plain data, or None where it is no YAML or JSON.

        Raises:
            InputError: It cannot be read.
        """
        content = self.content
        try:
            return text.parse(file_storage.as_yaml(content), self.name)
        except InputError:
            return None

    def read(self, name: str) -> bytes:
        """Return the bytes of a file.

        Raises:
            InputError: It cannot be read.
        """
        content = files.read_bytes(name)
        self._digests[name] = hashlib.sha256(content).hexdigest()
        return content

    def parse(self, name: str) -> Any:
        """Return the plain data of a YAML or JSON file, OpenCV's FileStorage included.

        Raises:
            InputError: It cannot be read, or is neither.
        """
        content = self.content if name == self.name else self.read(name)
        return text.parse(file_storage.as_yaml(content), name)

    def beside(self, name: str) -> str:
        """Return the path of a file that is named relative to this one, or lies in this folder."""
        folder = self.path if self.is_folder else self.path.parent
        return str(folder / name)


def list_folder(folder: Path) -> tuple[str, ...]:
    """Return the names of the files in a folder, sorted.

    Raises:
        InputError: It is no folder, or cannot be read.
    """
    try:
        return tuple(sorted(each.name for each in folder.iterdir() if each.is_file()))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"expected a readable folder: {reason}", where=str(folder)) from error
