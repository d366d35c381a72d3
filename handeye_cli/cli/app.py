"""The `handeye` command, and the one place where an error becomes text and an exit code."""

from __future__ import annotations

import gc
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from types import TracebackType

from handeye_cli import __version__
from handeye_cli.cli.flags import DEBUG
from handeye_cli.cli.grouping import command_of
from handeye_cli.cli.plain import plain_groups
from handeye_cli.errors import HandeyeError

COMMANDS = {
    "import": "handeye_cli.cli.import_",
    "extract": "handeye_cli.cli.extract",
    "extrinsics": "handeye_cli.cli.extrinsics",
    "solve": "handeye_cli.cli.solve",
    "verify": "handeye_cli.cli.verify",
    "export": "handeye_cli.cli.export",
    "inspect": "handeye_cli.cli.inspect",
    "report": "handeye_cli.cli.report",
    "plan": "handeye_cli.cli.plan",
    "simulate": "handeye_cli.cli.simulate",
    "simulate recording": "handeye_cli.cli.simulate_recording",
}
"""Every command in the order of the help, with the module that holds a function of its name."""

_LONGEST = 2
"""Words in the name of a command, at most."""

_GARBAGE = 50_000
"""Objects made between two searches for garbage."""


def run(args: Sequence[str]) -> None:
    """Carry out a command line in this process; leaves by SystemExit.

    Args:
        args: The words after `handeye`.
    """
    words = [word for word in args if word != DEBUG]
    try:
        _carry_out(words)
    except HandeyeError as error:
        if DEBUG in args:
            traceback.print_exception(error)
        _tell(_sentence(error))
        sys.exit(error.exit_code)


def _carry_out(words: list[str]) -> None:
    name, words = _named(words)
    if name:
        command = command_of(import_module(COMMANDS[name]), name)
        groups = plain_groups(command, words)
        if groups is not None:
            command(**groups)
            sys.exit(0)
    from typer.main import get_command

    from handeye_cli.cli.typer_front import application

    # The other commands are needed by the help of all and by "did you mean" only.
    modules = {each: import_module(COMMANDS[each]) for each in ([name] if name else COMMANDS)}
    get_command(application(modules))([name, *words] if name else words, prog_name="handeye")


def _named(words: list[str]) -> tuple[str, list[str]]:
    """Return the longest name of a command that a line starts with, and the words behind it."""
    for length in range(_LONGEST, 0, -1):
        name = " ".join(words[:length])
        if len(words) >= length and name in COMMANDS:
            return name, words[length:]
    return "", words


def main() -> None:
    """Run `handeye` as a process of its own."""
    # What start-up makes stays in use; to look for garbage in it again and again costs a tenth.
    gc.set_threshold(_GARBAGE)
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
    _tell(
        f"error: a bug in handeye {__version__}: {what}; run the same command with {DEBUG} and "
        "send the traceback to the maintainers"
    )


def _tell(text: str) -> None:
    sys.stderr.write(f"{text}\n")
