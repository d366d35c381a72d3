"""The errors a user can meet, each with the exit code it ends the command with.

An error says in one sentence what was expected and what was found, where (file, key, station),
and what to do next. The command line turns it into text; nothing else prints or exits.
"""

from __future__ import annotations

from typing import ClassVar


class HandeyeError(Exception):
    """Root of every error that is not a bug.

    Args:
        message: What was expected and what was found.
        where: The place: a file, a key in it, a station.
        hint: The next step, often a flag.
    """

    exit_code: ClassVar[int] = 1

    def __init__(self, message: str, *, where: str | None = None, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.hint = hint

    def __str__(self) -> str:
        text = f"{self.where}: {self.message}" if self.where else self.message
        return f"{text} ({self.hint})" if self.hint else text


class UsageError(HandeyeError):
    """The command's words are wrong (exit 2)."""

    exit_code = 2


class InputError(HandeyeError):
    """The input cannot be read or is not valid (exit 3)."""

    exit_code = 3


class UndeterminedError(HandeyeError):
    """The data do not determine the answer, or contradict what was declared (exit 4)."""

    exit_code = 4


class ConvergenceError(HandeyeError):
    """An iterative estimation did not converge (exit 5)."""

    exit_code = 5


class QualityGateError(HandeyeError):
    """A limit the user set was exceeded (exit 6)."""

    exit_code = 6


def did_you_mean(word: str, known: list[str]) -> str | None:
    """Return the known word nearest to a mistyped one, or None when none is near."""
    from difflib import get_close_matches

    matches = get_close_matches(word, known, n=1, cutoff=0.6)
    return matches[0] if matches else None
