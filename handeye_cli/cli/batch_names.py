"""Which recordings a batch is made of, and what the files are called that come of them."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

from handeye_cli.errors import InputError, UsageError

_LIST = "@"
_STDIN = "-"


def recording_names(words: Sequence[str]) -> list[str]:
    """Return the names of the recordings, those in lists among them.

    Args:
        words: Names, `@FILE` for the lines of a file, `@-` for those of stdin.

    Raises:
        UsageError: A recording is named twice, or is a document on stdin.
        InputError: A list cannot be read, or there is no name at all.
    """
    names = [name for word in words for name in _names_of(word)]
    if not names:
        raise InputError("expected names of recordings, found an empty list", where=words[0])
    if _STDIN in names:
        raise UsageError(
            "expected names of recordings, found '-', which is a single document on stdin",
            hint="@- reads names from stdin, one in each line",
        )
    # a path that is a link to itself has a name, too
    places = Counter(map(os.path.realpath, names))
    for name in names:
        if places[os.path.realpath(name)] > 1:
            raise UsageError(f"expected each recording once, found {name} twice")
    return names


def _names_of(word: str) -> list[str]:
    if not word.startswith(_LIST):
        return [word]
    path = word.removeprefix(_LIST)
    try:
        text = sys.stdin.read() if path == _STDIN else Path(path).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(f"expected a readable list of names: {reason}", where=word) from error
    if "\0" in text:
        found = text.partition("\0")[0].rpartition("\n")[2]
        raise InputError(
            f"expected one name in each line, found a zero byte after {found!r}",
            where=word,
            hint="separate the names by line breaks, as find does with -print and not with -print0",
        )
    return [line for line in text.splitlines() if line.strip()]


def unique_names(paths: Sequence[str]) -> list[str]:
    """Return a name for each path that no other has, on a disk that ignores case either.

    That is the file's name without its ending; where this is shared, with its ending, then with
    more and more of the folders above it.

    Args:
        paths: Different paths.
    """
    choices = [list(dict.fromkeys(_choices(Path(os.path.realpath(path))))) for path in paths]
    holders = Counter(each for choice in choices for each in {name.casefold() for name in choice})
    return [
        next(name for name in choice if holders[name.casefold()] == 1 or name == choice[-1])
        for choice in choices
    ]


def _choices(path: Path) -> Iterator[str]:
    *folders, _ = path.parts[1:] or (path.name,)
    for depth in range(len(folders) + 1):
        above = folders[len(folders) - depth :]
        yield "-".join((*above, path.stem))
        yield "-".join((*above, path.name))
    # two folders whose names hold dashes can still look the same: this tells any two paths apart
    yield quote(str(path), safe="")
