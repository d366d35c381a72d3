"""What the package can tell its users, read from its source: codes of findings, words of errors."""

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "handeye_cli"

_MAKERS = {"Finding": 0, "_as_finding": 1, "_try": 0}
"""Calls that take a code, with the place of the code among their arguments."""


def calls() -> Iterator[tuple[str, ast.Call, ast.Module]]:
    """Yield every call of a plain name or a method in the package: its name, itself, its module."""
    for path in sorted(PACKAGE.rglob("*.py")):
        module = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(module):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                yield name, node, module


def codes() -> tuple[set[str], set[str]]:
    """Return the codes that stand in the source, and the expressions that hand one on."""
    found, handed_on = set(), set()
    constants = _constants()
    for name, call, _ in calls():
        if name not in _MAKERS:
            continue
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
        target.id: node.value.value
        for path in PACKAGE.rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def messages(error: str) -> tuple[set[str], set[str]]:
    """Return what an error says wherever it is made.

    Returns:
        The longest piece of each message that stands in the source, and the expressions that hand
        a message on.
    """
    found, handed_on = set(), set()
    for name, call, _ in calls():
        if name == error:
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
