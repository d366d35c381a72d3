# ruff: noqa: T201 - a script talks to its user
"""Keep what the documents show true: print a marked command, or run the marked examples.

A command stands in the fenced block below `<!-- command: NAME -->`. An example stands in a console
block below `<!-- runnable -->`, or `<!-- runnable: exit 4 -->`: lines that start with `$ ` are run,
the lines below one are what a terminal shows. Numbers may differ from what is written, words may
not; a line `...` stands for any lines.

Usage:
    run_examples.py --print NAME FILE
    run_examples.py FILE...
"""

import fcntl
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
from pathlib import Path

COMMAND = r"<!-- command: {} -->\s*```\w*\n(.*?)```"
EXAMPLE = re.compile(r"<!-- runnable(?:: exit (\d+))? -->\s*```console\n(.*?)```", re.DOTALL)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
COLUMNS = 80


def marked_command(name: str, text: str) -> str:
    """Return the command below a marker."""
    found = re.findall(COMMAND.format(re.escape(name)), text, re.DOTALL)
    if len(found) != 1:
        sys.exit(f"expected one command marked {name!r}, found {len(found)}")
    return str(found[0]).strip()


def examples(text: str) -> list[tuple[int, str, str]]:
    """Return (exit code, command, shown output) of every example in a document."""
    steps = []
    for code, block in EXAMPLE.findall(text):
        for step in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = re.sub(r"\\\n\s*", "", step).partition("\n")
            steps.append((int(code or 0), command, shown))
    return steps


def run_in_terminal(command: str, folder: Path) -> tuple[int, str]:
    """Run a shell command with a terminal as its stdout; return exit code and output."""
    terminal, side = pty.openpty()
    fcntl.ioctl(side, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
    environment = {**os.environ, "TERM": "dumb", "NO_COLOR": "1", "COLUMNS": str(COLUMNS)}
    with tempfile.TemporaryFile() as complaints:
        process = subprocess.Popen(
            ["bash", "-o", "pipefail", "-c", command],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=side,
            stderr=complaints,
        )
        os.close(side)
        shown = read_all(terminal)
        code = process.wait()
        complaints.seek(0)
        return code, (shown + complaints.read()).decode().replace("\r\n", "\n")


def read_all(terminal: int) -> bytes:
    """Read a terminal until its last writer has gone."""
    parts = []
    while True:
        try:
            part = os.read(terminal, 4096)
        except OSError:  # how Linux says that the other side is closed
            part = b""
        if not part:
            os.close(terminal)
            return b"".join(parts)
        parts.append(part)


def words(text: str) -> str:
    """Return text with its numbers masked and its spaces squeezed."""
    lines = [" ".join(NUMBER.sub("#", line).split()) for line in text.strip().splitlines()]
    return "\n".join(line for line in lines if line) + "\n"


def agrees(shown: str, real: str) -> bool:
    """Whether a real output has the words of the one that is shown."""
    if not shown.strip():
        return True
    pattern = "".join(
        r"(?:.*\n)*?" if line == "..." else re.escape(line) + r"\n"
        for line in words(shown).splitlines()
    )
    return re.fullmatch(pattern, words(real)) is not None


def run_document(path: Path) -> int:
    """Run the examples of one document in a folder with the sample data; return how many failed."""
    failed = 0
    root = Path(__file__).resolve().parents[1]
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(root / "sample_data", Path(folder) / "sample_data")
        for expected, command, shown in examples(path.read_text(encoding="utf-8")):
            code, real = run_in_terminal(command, Path(folder))
            good = code == expected and agrees(shown, real)
            print(f"{'ok    ' if good else 'FAILED'} {path.name}: {command}")
            if not good:
                failed += 1
                print(f"exit code {code}, expected {expected}; the output was:\n{real}")
    return failed


def main(arguments: list[str]) -> None:
    """Do what the command line asks for."""
    if arguments[:1] == ["--print"]:
        name, path = arguments[1:]
        print(marked_command(name, Path(path).read_text(encoding="utf-8")))
        return
    paths = [Path(argument) for argument in arguments]
    if not any(examples(path.read_text(encoding="utf-8")) for path in paths):
        sys.exit("found no runnable example")
    if sum(run_document(path) for path in paths):
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
