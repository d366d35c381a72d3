"""The `handeye` application, and the one place where an error becomes text and an exit code."""

from __future__ import annotations

import inspect
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Annotated

import typer

from handeye_cli import __version__
from handeye_cli.cli import extract, extrinsics, plan, solve, verify
from handeye_cli.cli.grouping import flat
from handeye_cli.errors import HandeyeError

DEBUG = "--debug"

app = typer.Typer(
    name="handeye",
    epilog="The line is recording -> extract -> extrinsics -> solve -> verify; every command takes "
    "the recording or any document on the way and runs what is missing. Exit codes: 0 done, 1 a "
    "bug, 2 wrong usage, 3 bad input, 4 the data do not determine the answer, 5 not converged, "
    "6 a quality limit was missed.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _register(command: Callable[..., None], examples: Sequence[str]) -> None:
    paragraphs = inspect.cleandoc(command.__doc__ or "").split("\n\n")
    lines = ["Examples:", *(f"  $ {example}" for example in examples)]
    # A \b keeps the lines of the paragraph that follows it as they are.
    text = [*(paragraph.replace("\n", " ") for paragraph in paragraphs), "\n".join(["\b", *lines])]
    app.command(help="\n\n".join(text))(flat(command))


for _module, _command in (
    (extract, extract.extract),
    (extrinsics, extrinsics.extrinsics),
    (solve, solve.solve),
    (verify, verify.verify),
    (plan, plan.plan),
):
    _register(_command, _module.EXAMPLES)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"handeye {__version__}")
        raise typer.Exit


@app.callback()
def _handeye(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
    debug: Annotated[
        bool, typer.Option(DEBUG, help="Show the traceback of a bug; it may stand anywhere.")
    ] = False,
) -> None:
    """Find where a camera sits on a robot, from a recording, and say how sure that is."""


def run(args: Sequence[str]) -> None:
    """Carry out a command line in this process; leaves by SystemExit when there is an exit code.

    Args:
        args: The words after `handeye`.
    """
    words = [word for word in args if word != DEBUG]
    try:
        typer.main.get_command(app)(words, prog_name="handeye")
    except HandeyeError as error:
        if DEBUG in args:
            traceback.print_exception(error)
        typer.echo(_sentence(error), err=True)
        sys.exit(error.exit_code)


def main() -> None:
    """Run `handeye` as a process of its own."""
    # OpenCV would tell of a broken image too, in its own words and without the image's name.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
    # A reader that leaves early, as `head` does, ends the command as it ends any other tool.
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    if DEBUG not in sys.argv:
        sys.excepthook = _admit
    try:
        run(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)


def _sentence(error: HandeyeError) -> str:
    where = f"{error.where}: " if error.where else ""
    hint = f"\nhint: {error.hint}" if error.hint else ""
    return f"error: {where}{error.message}{hint}"


def _admit(kind: type[BaseException], bug: BaseException, _: TracebackType | None) -> None:
    """Say in one line that an exception nobody expected is a bug; Python then exits with 1."""
    what = f"{kind.__name__}: {' '.join(str(bug).split())}"
    typer.echo(
        f"error: a bug in handeye {__version__}: {what}; run the same command with {DEBUG} and "
        "send the traceback to the maintainers",
        err=True,
    )
