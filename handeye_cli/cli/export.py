"""`handeye export`: the answer in the files that other software reads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye_cli.cli import outputs
from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.checks import require_whole
from handeye_cli.cli.export_mount import mount_pose
from handeye_cli.cli.export_options import Destination, Form, Frames
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Solver, Source, Work
from handeye_cli.cli.progress import steps
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.pipeline import Steps
    from handeye_cli.records import Calibration

EXAMPLES = (
    "handeye export calibration.yaml --to static-transform-publisher \\\n"
    "      --parent tool0 --child camera_optical_frame",
    "handeye export calibration.yaml --to urdf --parent tool0 --child camera_optical_frame \\\n"
    "      --mount-frame camera_link --mount-T-optical data.mcap -o camera.urdf",
)


def export(
    *,
    source: Source,
    form: Form,
    frames: Frames,
    destination: Destination,
    mcap: Mcap,
    camera_file: CameraFile,
    intrinsics: Intrinsics,
    solver: Solver,
    work: Work,
) -> None:
    """Write where the camera sits for ROS, URDF, OpenCV and others, between frames with names.

    The parent is the frame that the camera is fixed to, the child the camera's optical frame: or,
    with --mount-frame, the link that its driver or model is placed by. A recording or an earlier
    document is calibrated first.
    """
    from handeye_cli import solvers
    from handeye_cli.documents import exports

    _check(form, frames, destination)
    solvers.load(solver.method)
    mount_T_optical = mount_pose(frames, source)
    inputs = open_inputs(source, mcap, camera_file)
    flags = given(source, mcap, camera_file, intrinsics, solver)
    with inputs[0].blamed(), steps(work, _as_output(destination), intrinsics) as how:
        calibration = _calibration(inputs, how, solver, intrinsics, flags)
    transform = exports.named(
        calibration,
        parent=frames.parent,
        child=frames.child,
        required=exports.load(form.to).needs_names,
        name=_name(form, destination),
    )
    if frames.mount_frame is not None and mount_T_optical is not None:
        transform = exports.at_mount(transform, frames.mount_frame, mount_T_optical)
    _write(exports.text(transform, form.to), destination)
    outputs.show_findings(calibration, notes=False)


def _check(form: Form, frames: Frames, destination: Destination) -> None:
    """Refuse what cannot be written, before anything is read for it."""
    from handeye_cli.documents import exports

    exports.check_names(
        parent=frames.parent,
        child=frames.child,
        mount_frame=frames.mount_frame,
        required=exports.load(form.to).needs_names,
    )
    exports.check_mount(form.to, frames.mount_frame)
    if _is_file(destination):
        exports.check_ending(form.to, str(destination.output))
    outputs.check_output(_as_output(destination))


def _calibration(
    inputs: list[Opened], how: Steps, solver: Solver, intrinsics: Intrinsics, flags: dict[str, Any]
) -> Calibration:
    """Return the calibration that is exported, computed where the input is an earlier stage."""
    from handeye_cli import documents, pipeline
    from handeye_cli.records import Calibration

    opened = inputs[0]
    if isinstance(opened.record, Calibration):
        _refuse(given(intrinsics, solver), opened.file[0])
        require_whole(opened.record)
        return opened.record
    found = pipeline.to_calibration(
        opened.record, how, method=solver.method, pairs=solver.pairs.value
    )
    # the same digits as from the document that `solve` would have written
    return documents.as_written(outputs.with_step(found, "export", inputs, flags))


def _refuse(flags: Mapping[str, Any], name: str) -> None:
    if flags:
        raise UsageError(
            f"--{next(iter(flags))} cannot act on a calibration, which {name} is",
            hint="leave it out, or give the recording or stations that were calibrated on",
        )


def _name(form: Form, destination: Destination) -> str:
    """Return what the calibration is filed under: the file's name, where there is one."""
    from handeye_cli.documents import exports

    if not _is_file(destination):
        return "handeye"
    return Path(str(destination.output)).name.removesuffix(exports.load(form.to).suffix)


def _is_file(destination: Destination) -> bool:
    return destination.output not in (None, outputs.STDOUT)


def _as_output(destination: Destination) -> Output:
    return Output(destination.output, destination.force, quiet=destination.quiet)


def _write(text: str, destination: Destination) -> None:
    from handeye_cli import documents

    if _is_file(destination):
        documents.write_text(text, str(destination.output), destination.force)
    else:
        outputs.print_text(text)
