"""Open what a command was given: a robot's recording, a document, or a document on stdin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.checks import require_whole
from handeye_cli.cli.grouping import given
from handeye_cli.cli.options import Mcap, Source
from handeye_cli.conventions import parse_duration
from handeye_cli.errors import ConvergenceError, InputError, UndeterminedError, UsageError
from handeye_cli.wording import first_few

if TYPE_CHECKING:
    from handeye_cli.recording import McapOptions
    from handeye_cli.records import TargetSpec

# Readers are imported where they are called: `--help` waits for none of them.


@dataclass(frozen=True)
class Opened:
    """A record and the file it came from.

    Attributes:
        record: What was read, with the flags applied that win over it.
        file: Name as it was given, and SHA-256.
        further: The same of the other files of a recording, where several were named.
    """

    record: Any
    file: tuple[str, str]
    further: tuple[tuple[str, str], ...] = ()

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Name and SHA-256 of all that was named."""
        return (self.file, *self.further)

    @property
    def label(self) -> str:
        """What messages call the input."""
        from handeye_cli.documents import label_of

        return first_few([label_of(name) for name, _ in self.files], 1)

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Name the file in what stages say of their data, since they do not know where it lies."""
        try:
            yield
        except (InputError, UndeterminedError, ConvergenceError) as error:
            name = self.label
            error.where = name if error.where is None else f"{name}: {error.where}"
            raise


def open_input(source: Source, mcap: Mcap, *, own_intrinsics: bool = False) -> Opened:
    """Read a command's input.

    Args:
        source: Flags about what is read.
        mcap: Flags about what is taken from a robot's recording.
        own_intrinsics: Whether the intrinsics come from a file of their own.

    Raises:
        InputError: It cannot be read or is not valid.
        UsageError: A flag cannot act on this kind of input.
    """
    target = None if source.target is None else _target(source.target)
    if _is_recording(source):
        return _open_mcap(source, mcap, target, own_intrinsics=own_intrinsics)
    _refuse(given(mcap), "an MCAP recording", source.source)
    return _open_document(source, target)


def open_looked(
    source: Source, mcap: Mcap, flags: dict[str, Any], *, own_intrinsics: bool = False
) -> Opened | None:
    """Look into a robot's recording; None for any other input.

    Args:
        source: Flags about what is read.
        mcap: Flags about what is taken from the recording.
        flags: All flags that were given.
        own_intrinsics: Whether the intrinsics come from a file of their own.

    Returns:
        A `recording.summary.Looked`: an inspection of what the recording holds, and the recording
        itself where nothing is in the way.

    Raises:
        InputError: It cannot be read or is not valid.
        UsageError: A flag cannot act on a recording.
    """
    from handeye_cli import recording

    if not _is_recording(source):
        return None
    target = None if source.target is None else _target(source.target)
    options = _mcap_options(source, mcap, target, own_intrinsics=own_intrinsics)
    return _opened(source, lambda path: recording.look(path, options, flags))


def _is_recording(source: Source) -> bool:
    """Return whether a robot's recording is meant.

    Raises:
        UsageError: One of several inputs is no recording.
    """
    from handeye_cli import recording

    for path in source.paths:
        if not recording.is_recording(path):
            if source.further:
                raise UsageError(
                    "expected one document, or several MCAP files of one recording, found "
                    f"{len(source.paths)} inputs, of which {path} is no MCAP file",
                    hint="run the command once for each document",
                )
            return False
    return True


def _target(spec: str) -> TargetSpec:
    from handeye_cli import targets

    return targets.parse(spec)


def open_calibration(path: str | None) -> Opened | None:
    """Read the document of a `--calibration` flag, if it was given.

    Raises:
        InputError: It cannot be read, is not valid, is no calibration or leaves directions free.
    """
    return None if path is None else as_calibration(_open_document(Source(path), None))


def as_calibration(opened: Opened) -> Opened:
    """Return what was read, which is a whole calibration.

    Raises:
        InputError: It is none, or leaves directions free.
    """
    from handeye_cli import pipeline
    from handeye_cli.records import Calibration

    with opened.blamed():
        pipeline.expect(opened.record, Calibration)
        require_whole(opened.record)
    return opened


def _open_document(source: Source, target: TargetSpec | None) -> Opened:
    from handeye_cli import documents, pipeline

    options = documents.ReadOptions(
        setup=source.setup,
        pose_units=source.pose_units,
        quaternion_order=source.quaternion_order,
        robot_poses=source.robot_poses,
        allow_outside=source.allow_outside,
    )
    read = documents.read_source(source.source, options)
    record = read.record if target is None else pipeline.with_target(read.record, target)
    return Opened(record, (read.name, read.sha256))


def _open_mcap(
    source: Source, mcap: Mcap, target: TargetSpec | None, *, own_intrinsics: bool
) -> Opened:
    from handeye_cli import recording

    options = _mcap_options(source, mcap, target, own_intrinsics=own_intrinsics)
    return _opened(source, lambda path: recording.read(path, options))


def _mcap_options(
    source: Source, mcap: Mcap, target: TargetSpec | None, *, own_intrinsics: bool
) -> McapOptions:
    from handeye_cli import recording

    conventions = Source(
        source.source,
        pose_units=source.pose_units,
        quaternion_order=source.quaternion_order,
        robot_poses=source.robot_poses,
        allow_outside=source.allow_outside,
    )
    _refuse(given(conventions), "a document", source.source)
    return recording.McapOptions(
        setup=source.setup,
        target=target,
        image_topic=mcap.image_topic,
        camera_info_topic=mcap.camera_info_topic,
        pose_topic=mcap.pose_topic,
        base_frame=mcap.base_frame,
        gripper_frame=mcap.gripper_frame,
        time_offset_ns=0 if mcap.time_offset is None else parse_duration(mcap.time_offset),
        moving=mcap.moving,
        own_intrinsics=own_intrinsics,
    )


def _opened(source: Source, read: Callable[[str | tuple[str, ...]], Any]) -> Opened:
    """Read a robot's recording, by one path or by several, and hash its files meanwhile."""
    from handeye_cli import recording
    from handeye_cli.cli.digests import digesting

    with digesting([recording.files_of(path) for path in source.paths]) as digests:
        record = read(source.paths if source.further else source.source)
        first, *further = zip(source.paths, digests.result(), strict=True)
    return Opened(record, first, tuple(further))


def _refuse(flags: dict[str, Any], needed: str, name: str) -> None:
    if flags:
        raise UsageError(
            f"--{next(iter(flags))} acts on {needed} only, and {name} is none",
            hint="leave the flag out, or check which file is meant",
        )
