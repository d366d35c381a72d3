"""`handeye import`: data of another tool as a document of ours."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.camera_options import CameraFile
from handeye_cli.cli.grouping import given
from handeye_cli.cli.import_options import ForeignKind, ForeignSource
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.lines import command_line
from handeye_cli.cli.options import Output
from handeye_cli.cli.outputs import (
    STDOUT,
    check_output,
    deliver,
    print_text,
    show_findings,
    with_step,
)
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.documents.imports import ImportOptions

EXAMPLES = (
    "handeye import arm.samples --setup eye-in-hand -o stations.yaml",
    "handeye import cal_data.yaml --target disc-grid:10x10:25.4mm:12.7mm:25.4mm -o recording.yaml",
    "handeye import poses.csv --images frames --camera camera.yaml --setup eye-to-hand "
    "--target charuco:5x7:36mm:18mm:DICT_6X6_250 -o recording.yaml",
)


def import_(
    *, source: ForeignSource, kind: ForeignKind, camera_file: CameraFile, output: Output
) -> None:
    """Read the data of another tool, and write them as a recording or stations document.

    What the data do not say - where the camera is fixed, what the target is, the intrinsics - is
    asked for by its flag. Images stay where they are: write the document beside them.
    """
    from handeye_cli.documents import imports

    _refuse_two_cameras(kind, camera_file)
    check_output(output)
    imported = imports.read(source.source, _options(source, kind, camera_file, output), kind.kind)
    inputs = [Opened(imported.record, file) for file in imported.files]
    record, inputs = _with_camera(imported.record, inputs, camera_file)
    flags = {"from": imported.kind} | given(source, replace(kind, kind=None), camera_file)
    record = with_step(record, "import", inputs, flags)
    if not deliver(record, output) and sys.stdout.isatty() and not output.quiet:
        _report(imported.kind, record, source, output)
    show_findings(record)


def _refuse_two_cameras(kind: ForeignKind, camera_file: CameraFile) -> None:
    if kind.no_camera and camera_file.camera is not None:
        raise UsageError("expected --camera or --no-camera, found both", hint="leave one out")


def _options(
    source: ForeignSource, kind: ForeignKind, camera_file: CameraFile, output: Output
) -> ImportOptions:
    from handeye_cli import targets
    from handeye_cli.documents.imports import ImportOptions

    to_file = output.output not in (None, STDOUT)
    return ImportOptions(
        setup=source.setup,
        target=None if source.target is None else targets.parse(source.target),
        pose_units=source.pose_units,
        quaternion_order=source.quaternion_order,
        robot_poses=source.robot_poses,
        images=kind.images,
        rotation=kind.rotation,
        folder=Path(str(output.output)).parent if to_file else Path(),
        allow_outside=source.allow_outside,
        own_camera=kind.no_camera or camera_file.camera is not None,
    )


def _with_camera(
    record: Any, inputs: list[Opened], camera_file: CameraFile
) -> tuple[Any, list[Opened]]:
    """Return the record with the intrinsics of a file that was named, and that file as an input."""
    if camera_file.camera is None:
        return record, inputs
    from handeye_cli import given_camera
    from handeye_cli.documents import cameras

    read = cameras.read(camera_file.camera, given_camera.image_size(record))
    file = Opened(read.camera, (read.name, read.sha256))
    return given_camera.with_camera(record, read.camera), [*inputs, file]


def _report(kind: str, record: Any, source: ForeignSource, output: Output) -> None:
    """Tell what was read and what comes next; a recording has no other report."""
    print_text(f"{source.source}: {kind}, {record.setup}, {len(record.stations)} stations\n")
    if output.output is None:
        print_text("  write the document with -o FILE\n")
    else:
        line = command_line("solve", output.output, _needed_flags(record, source))
        print_text(f"  next: {line}\n")


def _needed_flags(record: Any, source: ForeignSource) -> Iterator[str]:
    """Yield the flags without which the next command refuses the document."""
    from handeye_cli.records import Recording

    if source.allow_outside:
        yield "--allow-outside"
    if isinstance(record, Recording) and record.camera is None:
        yield "--calibrate-intrinsics"
