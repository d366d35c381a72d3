"""The flags for the answer as transforms in an MCAP file, and what they do."""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.options import Methods, Output, Source
from handeye_cli.cli.outputs import STDOUT
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.records import Calibration

_PANEL = "Answer as transforms"


class McapForm(StrEnum):
    """For whom the transforms are written."""

    ROS2 = "ros2"
    FOXGLOVE = "foxglove"


@dataclass(frozen=True)
class AnswerFile:
    """Where the answer goes as transforms, and how its frames are called."""

    mcap: Annotated[
        str | None,
        Flag(
            metavar="FILE",
            help="Write camera and target as static transforms into an MCAP file too.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    mcap_form: Annotated[
        McapForm,
        Flag(
            help="TFMessage on /tf_static, or foxglove.FrameTransforms as JSON.",
            rich_help_panel=_PANEL,
        ),
    ] = McapForm.ROS2
    parent_frame: Annotated[
        str | None,
        Flag(
            metavar="FRAME",
            help="Name of what the camera is fixed to; the recording's own if not set.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    child_frame: Annotated[
        str | None,
        Flag(
            metavar="FRAME",
            help="Name of the camera's optical frame; the recording's own if not set.",
            rich_help_panel=_PANEL,
        ),
    ] = None


def check_answer_file(answer: AnswerFile, source: Source, methods: Methods, output: Output) -> None:
    """Refuse a file that could not or should not be written, before any work is done for it.

    Raises:
        UsageError: Flags act on a file that is not asked for, or it exists and is not to be
            replaced, is an input or the document, or would hold an answer that is not whole.
        InputError: Its folder does not exist.
    """
    if answer.mcap is None:
        for name in given(answer):
            raise UsageError(
                f"--{name} acts on --mcap only, and there is none", hint="add --mcap FILE"
            )
        return
    if methods.partial:
        raise UsageError(
            "expected --mcap or --partial, found both: a transform is whole",
            hint="write the partial answer as a document with -o",
        )
    if answer.mcap == STDOUT:
        raise UsageError("expected --mcap to be the name of a file, found '-'")
    taken = [*source.paths, *([output.output] if output.output else [])]
    for path in taken:
        if os.path.realpath(path) == os.path.realpath(answer.mcap):
            raise UsageError(
                f"expected --mcap to be a file of its own, found {answer.mcap}, which is the "
                f"{'document' if path == output.output else 'input'}"
            )
    from handeye_cli import documents

    documents.check_destination(answer.mcap, output.force)


def write_answer(
    calibration: Calibration, answer: AnswerFile, opened: Opened, output: Output
) -> None:
    """Write the transforms, if they are asked for.

    Args:
        calibration: The answer.
        answer: The flags.
        opened: What it was found from; a robot's recording has names for the frames.
        output: Whether a file that is there may be replaced.

    Raises:
        UsageError: Two frames would have the same name.
        InputError: The file cannot be written.
    """
    if answer.mcap is None:
        return
    from handeye_cli import documents
    from handeye_cli.answer_transforms import answer_transforms, notes_of
    from handeye_cli.recording import transform_files

    transforms = answer_transforms(
        calibration,
        getattr(opened.record, "frames", None),
        parent=answer.parent_frame,
        child=answer.child_frame,
    )
    foxglove = answer.mcap_form is McapForm.FOXGLOVE
    write = transform_files.write_foxglove if foxglove else transform_files.write_ros2
    with documents.streamed_file(answer.mcap, output.force) as file:
        write(file, transforms, notes_of(calibration))
