# ruff: noqa: T201 - a script talks to its user
"""Keep what the documents show true: print a marked command, or run the marked examples.

A command stands in the fenced block below `<!-- command: NAME -->`. An example stands in a console
block below `<!-- runnable -->`, or `<!-- runnable: exit 4 -->`: lines that start with `$ ` are run,
the lines below one are what a terminal shows. Words have to be those that are written, and numbers
near those; a line `...` stands for any lines.

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
NEAR = 0.05
"""Part of a number by which it may differ: versions of a library round in other ways."""
LAST_DIGITS = 2.0
"""Units of its last digit by which a number may differ."""
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


def squeezed(text: str) -> list[str]:
    """Return the lines of a text that are not empty, with their spaces squeezed."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def near(shown: str, real: str) -> bool:
    """Whether a number is as good as the one that is shown."""
    digits = len(shown.partition("e")[0].partition(".")[2])
    least = LAST_DIGITS * 10.0**-digits if digits else 0.0
    return abs(float(shown) - float(real)) <= max(NEAR * abs(float(shown)), least)


def alike(shown: str, real: str) -> bool:
    """Whether a line has the words of the one that is shown, and numbers near its own."""
    numbers = zip(NUMBER.findall(shown), NUMBER.findall(real), strict=False)
    return NUMBER.split(shown) == NUMBER.split(real) and all(near(*pair) for pair in numbers)


def follows(shown: list[str], real: list[str]) -> bool:
    """Whether lines are those that are shown, where `...` stands for any."""
    if not shown:
        return not real
    if shown[0] == "...":
        return any(follows(shown[1:], real[start:]) for start in range(len(real) + 1))
    return bool(real) and alike(shown[0], real[0]) and follows(shown[1:], real[1:])


def agrees(shown: str, real: str) -> bool:
    """Whether a real output is as good as the one that is shown."""
    return not shown.strip() or follows(squeezed(shown), squeezed(real))


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
