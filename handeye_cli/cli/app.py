"""The `handeye` command, and the one place where an error becomes text and an exit code."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from typing import TYPE_CHECKING

from handeye_cli import __version__
from handeye_cli.cli.commands import COMMANDS
from handeye_cli.cli.flags import DEBUG
from handeye_cli.cli.grouping import command_of
from handeye_cli.cli.plain import plain_groups
from handeye_cli.cli.values import check_values
from handeye_cli.errors import HandeyeError, InputError, UsageError, did_you_mean

if TYPE_CHECKING:
    from types import FrameType, TracebackType

_LONGEST = 2
"""Words in the name of a command, at most."""

_HELP = (["--help"], ["-h"])
"""Lines that ask for help and for nothing else."""

_WRONG_USAGE = 2
"""Exit code of a line without a word."""

_ENDING = ("SIGTERM", "SIGHUP")
"""Signals that ask a process to end; not every system has them."""

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
            import traceback

            traceback.print_exception(error)
        _tell(_sentence(error))
        sys.exit(error.exit_code)


def _carry_out(words: list[str]) -> None:
    name, words = _named(words)
    text = _text_asked_for(name, words)
    if text is not None:
        _say(text)
        sys.exit(0 if name or words else _WRONG_USAGE)
    if name:
        command = command_of(import_module(COMMANDS[name]), name)
        groups = plain_groups(command, words)
        if groups is not None:
            check_values(groups, name)
            command(**groups)
            sys.exit(0)
    _refuse_unknown(name, words)
    from handeye_cli.cli import typer_front

    # The other commands are needed by the completion of shells only.
    modules = {each: import_module(COMMANDS[each]) for each in ([name] if name else COMMANDS)}
    sys.exit(typer_front.carry_out(modules, name, words))


def _text_asked_for(name: str, words: list[str]) -> str | None:
    """Return what a line wants to read: help or the version; None when it wants work done."""
    if words == ["--version"] and not name:
        return f"handeye {__version__}\n"
    if words in _HELP or not (name or words or _asked_by_shell()):
        from handeye_cli.cli import help as texts

        return texts.of_command(name, import_module(COMMANDS[name])) if name else texts.of_all()
    return None


def _asked_by_shell() -> bool:
    return "_HANDEYE_COMPLETE" in os.environ


def _refuse_unknown(name: str, words: Sequence[str]) -> None:
    """Refuse a line that starts with a word that is no command."""
    if name or not words or words[0].startswith("-") or _asked_by_shell():
        return
    near = did_you_mean(words[0], list(COMMANDS))
    raise UsageError(
        f"expected a command, found {words[0]!r}",
        hint=f"did you mean handeye {near}?" if near else "handeye --help lists them",
    )


def _named(words: list[str]) -> tuple[str, list[str]]:
    """Return the longest name of a command that a line starts with, and the words behind it."""
    for length in range(_LONGEST, 0, -1):
        name = " ".join(words[:length])
        if len(words) >= length and name in COMMANDS:
            return name, words[length:]
    return "", words


def main() -> None:
    """Run `handeye` as a process of its own."""
    # What start-up makes stays in use; to look for garbage in it again and again costs a tenth,
    # and to look through all that is left when the process ends, half as much.
    gc.set_threshold(_GARBAGE)
    atexit.register(gc.freeze)
    # OpenCV would tell of a broken image too, in its own words and without the image's name.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
    # Matrices here are small: threads would wait for each other where processors are busy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # A reader that leaves early, as `head` does, ends the command as it ends any other tool.
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for name in _ENDING:
        number = getattr(signal, name, None)
        # not where the caller has it ignored, as `nohup` does
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _leave)
    if DEBUG not in sys.argv:
        sys.excepthook = _admit
    _settle_encoding()
    try:
        run(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)


def _settle_encoding() -> None:
    """Write UTF-8 into files and pipes whatever the locale is; show a terminal what it can show."""
    if isinstance(sys.stdout, TextIOWrapper):
        encoding = None if sys.stdout.isatty() else "utf-8"
        sys.stdout.reconfigure(encoding=encoding, errors="backslashreplace")


def _leave(number: int, _: FrameType | None) -> None:
    """End by way of SystemExit, so that files that are not whole are taken away."""
    sys.exit(128 + number)


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


def _say(text: str) -> None:
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where="standard output") from error


def _tell(text: str) -> None:
    sys.stderr.write(f"{text}\n")
