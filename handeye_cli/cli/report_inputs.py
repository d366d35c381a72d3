"""What a report is made of: the files that were named, and those that their documents name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from handeye_cli.cli.camera_options import CameraFile, open_inputs
from handeye_cli.cli.grouping import flags_of, given
from handeye_cli.cli.inputs import Opened, open_input
from handeye_cli.cli.looked import open_both
from handeye_cli.cli.options import Mcap, Source
from handeye_cli.cli.report_options import Sources
from handeye_cli.errors import InputError, UsageError

if TYPE_CHECKING:
    from handeye_cli.records import ProvenanceStep
    from handeye_cli.records.recording_summary import RecordingSummary
    from handeye_cli.reporting.case import Read

_VERIFY = "verify"
Group = TypeVar("Group")


@dataclass
class Library:
    """Files by their digests.

    Attributes:
        reads: What was read, in the order of the page.
        missing: Why a file was not read that a document was made from, by its digest.
    """

    reads: list[Read] = field(default_factory=list)
    missing: dict[str, str] = field(default_factory=dict)

    def has(self, sha256: str) -> bool:
        """Return whether a file was read, or was looked for in vain."""
        return sha256 in self.missing or any(each.sha256 == sha256 for each in self.reads)

    def unreached(self, provenance: Sequence[ProvenanceStep]) -> str | None:
        """Return why images are not at hand, where a file that led to a document is not."""
        from handeye_cli.reporting.case import since_recording

        inputs = [step.inputs[0] for step in since_recording(provenance) if step.inputs]
        reasons = [self.missing[sha] for _, sha in inputs if sha in self.missing]
        return f"The images are not at hand: {reasons[0]}." if reasons else None


def open_library(sources: Sources, mcap: Mcap, camera_file: CameraFile) -> Library:
    """Read the files that were named, then those they were made from, as far as they are there.

    Args:
        sources: The files, with the flags about them.
        mcap: Flags about what is taken from a robot's recording.
        camera_file: Intrinsics that win over those of the recording, or of the first document.

    Raises:
        InputError: A file that was named cannot be read or is not valid.
        UsageError: A flag cannot act on the recording, or on the first document.
    """
    library = Library()
    first, *others = _inputs(sources)
    opened, summary = _first(first, mcap, camera_file)
    _add(library, opened, asked=True, summary=summary)
    for other in others:
        _add(library, open_input(other, Mcap()), asked=True)
    for read in library.reads:  # the list grows while it is walked: what is found names more
        for step, name, sha256 in _named_by(read):
            if not library.has(sha256):
                allow_outside = sources.allow_outside
                _reach(library, read, step, name, sha256, allow_outside=allow_outside)
    return library


def _inputs(sources: Sources) -> list[Source]:
    """Return what is read at a time: the robot's recording first, then every document."""
    from handeye_cli import recording

    names = [sources.source, *(sources.further or ())]
    recorded = [name for name in names if recording.is_recording(name)]
    at_a_time = [recorded, *([name] for name in names if name not in recorded)]
    (first, *further), *others = [each for each in at_a_time if each]
    flagged = replace(sources, source=first, further=further or None)
    return [flagged, *(Source(name) for (name,) in others)]


def _first(
    source: Source, mcap: Mcap, camera_file: CameraFile
) -> tuple[Opened, RecordingSummary | None]:
    """Return what the flags are about, and what it holds if it is a robot's recording."""
    (opened, *_), looked = open_both(source, mcap, camera_file, given(source, mcap, camera_file))
    if looked is None:
        return opened, None
    if opened.record is looked:  # to be read without looking around, which says what is in the way
        opened = open_inputs(source, mcap, camera_file)[0]
    return opened, looked.recording


def _add(
    library: Library, opened: Opened, *, asked: bool, summary: RecordingSummary | None = None
) -> None:
    from handeye_cli.reporting.case import Read

    name, sha256 = opened.file
    if not library.has(sha256):
        library.reads.append(Read(name, sha256, opened.record, asked, summary))


def _named_by(read: Read) -> Iterator[tuple[ProvenanceStep, str, str]]:
    """Yield the files a document was made from, the nearest first.

    Beside the line itself that is the calibration that a verification checked.
    """
    from handeye_cli.documents.files import STDIN

    for step in reversed(read.history):
        wanted = step.inputs if step.command == _VERIFY else step.inputs[:1]
        for name, sha256 in wanted:
            if name != STDIN:
                yield step, name, sha256


def _reach(
    library: Library,
    read: Read,
    step: ProvenanceStep,
    name: str,
    sha256: str,
    *,
    allow_outside: bool,
) -> None:
    """Read a file that a document names, or note why it is missing.

    The flags are those the document was made with, but for one: whether paths may lead anywhere is
    for the user to say and not for a document.
    """
    path = _found(name, Path(read.name).parent)
    if path is None:
        library.missing[sha256] = f"{name} is no longer where it was"
        return
    parts = _parts(read, step, name)
    try:
        source = _group(
            Source, step.options, source=path, further=parts, allow_outside=allow_outside
        )
        opened = open_input(source, _group(Mcap, step.options))
    except (InputError, UsageError) as error:
        library.missing[sha256] = f"{name} cannot be read: {error.message}"
        return
    if opened.file[1] != sha256:
        library.missing[sha256] = f"{name} has changed since"
        return
    _add(library, opened, asked=False)


def _parts(read: Read, step: ProvenanceStep, name: str) -> list[str] | None:
    """Return the other files of a recording that came in several, where they still are."""
    from handeye_cli import recording

    beside = Path(read.name).parent
    paths = [_found(each, beside) for each, _ in step.inputs if each != name]
    return [path for path in paths if path and recording.is_recording(path)] or None


def _found(name: str, beside: Path) -> str | None:
    """Return where a file is: where it was, or beside the document that names it.

    A device or pipe is none, since reading it might never end.
    """
    places = (Path(name), beside / name, beside / Path(name).name)
    return next((str(place) for place in places if _is_there(place)), None)


def _is_there(place: Path) -> bool:
    try:
        return place.is_file() or place.is_dir()
    except OSError:  # no file can have such a name
        return False


def _group(group: type[Group], options: Mapping[str, Any], **values: Any) -> Group:
    """Return a group of flags as a document says they were given.

    Args:
        group: The group.
        options: The flags of a step.
        values: Fields that are no flags of the document.

    Raises:
        UsageError: A flag cannot have been given so.
    """
    kinds = flags_of(group)
    for name in kinds:
        option = name.replace("_", "-")
        if name not in values and option in options:
            values[name] = _converted(option, kinds[name][0], options[option])
    return group(**{name: value for name, value in values.items() if name in kinds})


def _converted(option: str, kind: Any, value: Any) -> Any:
    """Return a flag's value, whose type is `kind` or one of its alternatives."""
    for each in get_args(kind) or (kind,):
        if issubclass(each, Enum) and value in [member.value for member in each]:
            return each(value)
        if isinstance(value, each):
            return value
    raise UsageError(f"its provenance says --{option} {value}, which is no such flag")
