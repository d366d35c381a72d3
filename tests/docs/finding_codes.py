"""What the package can tell its users, read from its source: codes of findings, words of errors."""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "handeye_cli"

_MAKERS = {"Finding": 0, "_as_finding": 1, "_try": 0}
"""Calls that take a code, with the place of the code among their arguments."""


@cache
def sources() -> dict[str, str]:
    """Return the text of every module of the package by its path."""
    paths = sorted(PACKAGE.rglob("*.py"))
    return {str(path): path.read_text(encoding="utf-8") for path in paths}


@cache
def _module(path: str) -> ast.Module:
    return ast.parse(sources()[path])


def calls(wanted: Iterable[str]) -> Iterator[tuple[str, ast.Call]]:
    """Yield every call of plain names or methods in the package, each with its name."""
    spelled = [f"{name}(" for name in wanted]
    for path, text in sources().items():
        if not any(each in text for each in spelled):
            continue
        for node in ast.walk(_module(path)):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                if name in wanted:
                    yield name, node


def codes() -> tuple[set[str], set[str]]:
    """Return the codes that stand in the source, and the expressions that hand one on."""
    found, handed_on = set(), set()
    constants = _constants()
    for name, call in calls(_MAKERS):
        code = (call.args + [each.value for each in call.keywords])[_MAKERS[name]]
        if isinstance(code, ast.Constant):
            found.add(code.value)
        elif isinstance(code, ast.Name) and code.id in constants:
            found.add(constants[code.id])
        else:
            handed_on.add(ast.unparse(code))
    return found, handed_on


def _constants() -> dict[str, str]:
    """Return the constants of all modules that are texts, by their names."""
    return {
        name: value
        for text in sources().values()
        for name, value in re.findall(r'^(\w+) = "([^"\\]*)"$', text, re.MULTILINE)
    }


def messages(error: str) -> tuple[set[str], set[str]]:
    """Return what an error says wherever it is made.

    Returns:
        The longest piece of each message that stands in the source, and the expressions that hand
        a message on.
    """
    found, handed_on = set(), set()
    for _, call in calls([error]):
        pieces = [
            part.value.strip(" ,:.;")
            for part in ast.walk(call.args[0])
            if isinstance(part, ast.Constant) and isinstance(part.value, str)
        ]
        longest = max(pieces, key=len, default="")
        if len(longest) > 1:
            found.add(longest)
        else:
            handed_on.add(ast.unparse(call.args[0]))
    return found, handed_on
