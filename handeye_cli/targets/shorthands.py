"""The `--target` shorthand of a board, read and written by the template its class declares."""

from __future__ import annotations

import re
from typing import Any

from handeye_cli.conventions import MM, parse_length
from handeye_cli.errors import UsageError
from handeye_cli.records import TargetSpec
from handeye_cli.targets.board import Board
from handeye_cli.targets.keys import Key, keys_of

_OPTIONAL = re.compile(r"\[(.*?)\]")
_PLACE = re.compile(r"\{(\w+)\}")


def parse(board: type[Board], text: str) -> TargetSpec:
    """Return the target a shorthand describes; its values are not checked yet.

    Raises:
        UsageError: The shorthand does not follow the template, or a length has no unit.
    """
    keys = keys_of(board)
    match = re.fullmatch(_pattern(board.SHORTHAND, keys), text.removeprefix(board.TYPE))
    if match is None:
        usage = board.TYPE + _PLACE.sub(lambda place: _label(place[1]), board.SHORTHAND)
        raise UsageError(
            f"expected {usage}, found {text!r}", where="--target", hint=f"such as {board.EXAMPLE}"
        )
    given = {name: word for name, word in match.groupdict().items() if word is not None}
    try:
        return TargetSpec(
            board.TYPE, {name: _read(keys[name], word) for name, word in given.items()}
        )
    except UsageError as error:
        hint = f"such as {board.EXAMPLE}"
        raise UsageError(error.message, where="--target", hint=hint) from error


def write(board: Board) -> str:
    """Return the shorthand of a board."""
    given = board.spec.parameters

    def keep(option: re.Match[str]) -> str:
        names = _PLACE.findall(option[1])
        return option[1] if all(name in given for name in names) else ""

    template = _OPTIONAL.sub(keep, board.SHORTHAND)
    return board.TYPE + _PLACE.sub(lambda place: _word(place[1], given[place[1]]), template)


def _pattern(template: str, keys: dict[str, Key]) -> str:
    groups = template.replace("[", "(?:").replace("]", ")?")
    return _PLACE.sub(lambda place: f"(?P<{place[1]}>{_word_pattern(keys[place[1]])})", groups)


def _word_pattern(key: Key) -> str:
    if key.kind is bool:
        return f"{key.name}(?:=(?:true|false))?"
    return r"\d{1,9}" if key.kind is int else "[^:]+"


def _read(key: Key, word: str) -> Any:
    if key.kind is int:
        return int(word)
    if key.kind is float:
        # twelve digits: 25.4mm is 25.4 again after its way through metres
        return float(f"{parse_length(word) / MM:.12g}")
    return not word.endswith("=false") if key.kind is bool else word


def _word(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return name if value else f"{name}=false"
    if name.endswith("_mm"):
        return f"{float(value)!r}".removesuffix(".0") + "mm"
    return str(value)


def _label(name: str) -> str:
    return name if name == "legacy" else name.removesuffix("_mm").upper()
