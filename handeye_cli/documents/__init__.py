"""Our own files: every record of the line as a YAML or JSON document.

`read` turns a document into its record, `dump` and `write` a record into its document. A document
is checked against its JSON Schema (see `schemas/`) before anything else looks at it.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol, TypeVar, cast

from handeye_cli.documents import files, layout, schema, text
from handeye_cli.documents.context import NO_FLAGS, Context, ReadOptions, context_of
from handeye_cli.documents.files import (
    check_destination,
    label_of,
    read_bytes,
    streamed_file,
    write_bytes,
    write_text,
)
from handeye_cli.documents.layout import Form
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions

if TYPE_CHECKING:
    from handeye_cli.records import (
        Calibration,
        Features,
        Inspection,
        Plan,
        Recording,
        Simulation,
        Stations,
        Verification,
    )
    from handeye_cli.records.batch import Batch
    from handeye_cli.records.truth import Truth

    Record = (
        Recording
        | Features
        | Stations
        | Calibration
        | Verification
        | Batch
        | Truth
        | Inspection
        | Plan
        | Simulation
    )

__all__ = [
    "ReadOptions",
    "Source",
    "as_written",
    "check_destination",
    "dump",
    "form_of",
    "label_of",
    "read",
    "read_bytes",
    "read_source",
    "source_of",
    "streamed_file",
    "write",
    "write_bytes",
    "write_text",
]

AnyRecord = TypeVar("AnyRecord", bound="Features | Stations | Calibration")


class _Kind(Protocol):
    """What the module of a kind of document offers."""

    def record_from_data(self, data: dict[str, Any], context: Context) -> Record: ...

    def data_from_record(self, record: Record) -> dict[str, Any]: ...


@dataclass(frozen=True)
class Source:
    """A document that was read, and what provenance says of it.

    Attributes:
        name: The path as it was given, `-` for standard input.
        sha256: Digest of its bytes in hex.
        record: What it holds.
    """

    name: str
    sha256: str
    record: Record


def read(source: str, options: ReadOptions = NO_FLAGS, stdin: BinaryIO | None = None) -> Record:
    """Return the record of a document.

    Args:
        source: A path, or `-` for standard input.
        options: The user's flags, which win over what the document says.
        stdin: The stream to read for `-`; the process's own when None.

    Raises:
        InputError: It cannot be read, or is no valid document.
    """
    return read_source(source, options, stdin).record


def read_source(
    source: str, options: ReadOptions = NO_FLAGS, stdin: BinaryIO | None = None
) -> Source:
    """Return the record of a document with its name and digest; see `read`."""
    return source_of(source, read_bytes(source, stdin), options)


def source_of(source: str, content: bytes, options: ReadOptions = NO_FLAGS) -> Source:
    """Return the record of a document whose bytes are there already; see `read`."""
    label = files.label_of(source)
    data = text.parse(content, label)
    kind = schema.kind_of(data, label)
    schema.validate(data, kind, label)
    folder = Path() if source == files.STDIN else Path(source).parent
    record = _module(kind).record_from_data(data, context_of(data, options, label, folder))
    return Source(source, hashlib.sha256(content).hexdigest(), record)


def as_written(record: AnyRecord) -> AnyRecord:
    """Return a record as it comes back from its own document.

    A pose that was written as a quaternion loses the last bits of its matrix. A stage that works
    on what its predecessor would have written gives the same digits whether the two run in one
    command or in a pipe.

    Raises:
        InputError: The record cannot be a document: its images are no files.
    """
    module = _module(_kind_of(record))
    context = Context(Place("a record"), Path(), record.setup, PoseConventions())
    return cast(AnyRecord, module.record_from_data(module.data_from_record(record), context))


def dump(record: Record, form: Form) -> str:
    """Return a record's document as text, `yaml` or `json`; the same text for the same record.

    Raises:
        InputError: The record cannot be a document: its images are no files.
        ValueError: A number of the record is not finite.
    """
    return layout.dump(_module(_kind_of(record)).data_from_record(record), form)


def write(record: Record, destination: str, force: bool = False) -> None:
    """Write a record's document, as JSON where the name ends in `.json`, else as YAML.

    Args:
        record: What to write.
        destination: Path of the file.
        force: Whether a file that is there may be replaced.

    Raises:
        UsageError: The file exists and may not be replaced.
        InputError: It cannot be written.
    """
    write_text(dump(record, form_of(destination)), destination, force)


def form_of(path: str) -> Form:
    """Return the form of a document by the ending of its file."""
    return "json" if Path(path).suffix.lower() == ".json" else "yaml"


def _kind_of(record: Record) -> str:
    """Return the kind of document a record makes, which its class is named after."""
    return type(record).__name__.lower()


def _module(kind: str) -> _Kind:
    return cast(_Kind, import_module(f"handeye_cli.documents.{kind}"))
