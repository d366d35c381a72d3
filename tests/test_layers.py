"""The rooms of the house: imports point downwards only, and what is slow is loaded when used."""

import ast
import graphlib
import json
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from cli.scene import stations_document

PACKAGE = Path(__file__).resolve().parents[1] / "handeye_cli"

LEVEL = {
    "__init__": 0, "lazily": 0, "errors": 0, "conventions": 0, "wording": 0,
    "geometry": 1,
    "records": 2, "images": 2, "image_headers": 2, "markup": 2,
    "targets": 3, "solvers": 3, "recording": 3, "documents": 3,
    "render": 5,
    "cli": 6, "api": 6, "__main__": 6,
}  # fmt: skip
STAGE = 4  # whatever else lies at the top of the package is a stage or part of one
STRANGERS = {"targets", "solvers", "recording", "documents"}
MODULES = sorted(PACKAGE.rglob("*.py"))
FRONT = PACKAGE / "__init__.py"  # names what lies above it, and loads it when it is asked for


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


@cache
def nodes(path: Path) -> list[ast.AST]:
    """Return all of a module's syntax that the tests look at."""
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in tree if isinstance(node, (ast.Import, ast.ImportFrom, ast.Call))]


def imports(path: Path) -> Iterator[str]:
    """Yield the dotted name of everything a module imports, inside functions too."""
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def imported_rooms(path: Path) -> Iterator[str]:
    for name in imports(path) if path != FRONT else ():
        package, _, rest = name.partition(".")
        if package == PACKAGE.name:
            room = rest.partition(".")[0]
            yield "__init__" if room.startswith("__") else room


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_downwards(path):
    here = room_of(path)
    for there in set(imported_rooms(path)) - {here}:
        assert LEVEL.get(there, STAGE) <= LEVEL.get(here, STAGE), f"{here} imports {there}"
        assert not {here, there} <= STRANGERS, f"{here} knows {there}"


def test_rooms_have_no_circle():
    graph = defaultdict(set)
    for path in MODULES:
        graph[room_of(path)] |= set(imported_rooms(path)) - {room_of(path)}
    graphlib.TopologicalSorter(graph).prepare()


def calls(path: Path) -> set[str]:
    return {dotted(node.func) for node in nodes(path) if isinstance(node, ast.Call)}


def dotted(called: ast.expr) -> str:
    """Return the name of what is called, as far as it is one."""
    if isinstance(called, ast.Attribute):
        return f"{dotted(called.value)}.{called.attr}"
    return called.id if isinstance(called, ast.Name) else ""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_only_the_command_line_talks_to_the_terminal(path):
    room = room_of(path)
    if room == "cli":
        return
    assert not {name for name in imports(path) if name.split(".")[0] in {"typer", "click"}}
    assert not calls(path) & {"sys.exit", "exit", "quit"}
    assert room == "render" or "print" not in calls(path)


def loaded_by(*words: str) -> set[str]:
    """Return the top-level modules that a run of the command line has loaded at its end."""
    program = (
        "import atexit, sys\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "from handeye_cli.cli.app import main\n"
        "sys.argv[0] = 'handeye'\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=True
    )
    return {name.partition(".")[0] for name in done.stderr.split()}


def test_the_package_itself_loads_nothing_heavy():
    program = "import sys, handeye_cli; dir(handeye_cli); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not set(done.stdout.split()) & {"numpy", "scipy", "yaml", "typer", "handeye_cli.api"}


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["solve", "--help"]])
def test_help_loads_nothing_heavy(words):
    assert not loaded_by(*words) & {"numpy", "scipy", "cv2", "mcap", "yaml"}


def test_poses_alone_need_little_more_than_numpy(tmp_path):
    stations = tmp_path / "stations.json"
    stations.write_text(json.dumps(stations_document(6)), encoding="utf-8")
    loaded = loaded_by("solve", str(stations), "-o", str(tmp_path / "calibration.yaml"))
    assert "numpy" in loaded
    assert not loaded & {"cv2", "scipy", "typer", "pydantic", "rich"}
