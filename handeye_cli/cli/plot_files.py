"""The files of `--plot`: what they must be before any work is done for them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from handeye_cli.cli.options import Output
from handeye_cli.errors import UsageError

_PNG = ".png"


def check_plot(files: Sequence[str], output: Output) -> None:
    """Refuse pictures that cannot be made.

    Args:
        files: Paths of the pictures.
        output: Whether files that are there may be replaced.

    Raises:
        UsageError: A file is not to be a PNG, or exists and is not to be replaced; or Matplotlib
            is not installed.
        InputError: The folder of a file is not there.
    """
    from handeye_cli import documents
    from handeye_cli.render.sheet import require_matplotlib

    for path in map(Path, files):
        if path.suffix.lower() != _PNG:
            message = f"expected a file that ends in {_PNG}, found {path.name!r}"
            raise UsageError(message, where="--plot")
    require_matplotlib()
    for file in files:
        documents.check_destination(file, output.force)
