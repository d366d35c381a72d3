"""SHA-256 of files, computed while they are read; on a free processor it costs no time."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Event

from handeye_cli.errors import InputError

_BLOCK_BYTES = 2**20


@contextmanager
def digesting(inputs: Sequence[Sequence[str]]) -> Iterator[Future[list[str]]]:
    """Compute digests beside what is done meanwhile, and no longer than that.

    Args:
        inputs: For each digest the files it is of, one behind the other.

    Yields:
        The digests in hex, to be asked for before the end.
    """
    stop = Event()
    with ThreadPoolExecutor(max_workers=1) as pool:
        try:
            yield pool.submit(lambda: [_sha256(files, stop) for files in inputs])
        finally:
            stop.set()


def _sha256(files: Sequence[str], stop: Event) -> str:
    digest, block = hashlib.sha256(), memoryview(bytearray(_BLOCK_BYTES))
    for path in files:
        try:
            if not Path(path).is_file():  # to open a pipe might take forever
                raise InputError("expected a file, found none", where=path)
            with Path(path).open("rb", buffering=0) as file:
                while not stop.is_set() and (size := file.readinto(block)):
                    digest.update(block[:size])
        except OSError as fault:
            raise InputError(f"cannot read it: {fault.strerror}", where=path) from fault
    return digest.hexdigest()
