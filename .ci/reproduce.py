# ruff: noqa: T201 - a script talks to its caller
"""Whether several Pythons with different versions of what handeye rests on get the same numbers.

Each runs the same commands on the sample data. An answer may differ from the first Python's by a
twentieth of its own predicted error; all other numbers by a fiftieth, or by the ten thousandth of
a mrad, mm or pixel: OpenCV 4 and 5 do not find quite the same pixels. Layouts as good as each other
there are many, so of an optimized plan only its error is compared.

Usage:
    reproduce.py PYTHON PYTHON...
"""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = "sample_data/paper-plate/recording.yaml"
COMMANDS = {
    "solve": ["solve", SAMPLE],
    "tsai-lenz": ["solve", SAMPLE, "--method", "tsai-lenz"],
    "verify": ["verify", SAMPLE, "--leave-one-out"],
    "plan": ["plan", "--stations", "5", "--optimize"],
    "simulate": ["simulate", "--trials", "200", "--seed", "4"],
}
PACKAGES = ("numpy", "scipy", "opencv-python-headless", "pyyaml", "typer", "mcap")
OF_PREDICTED, RELATIVE, ABSOLUTE = 0.05, 0.02, 1e-4
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def run(python: str, words: list[str]) -> dict:
    """Return the document that a command writes."""
    done = subprocess.run(
        [python, "-m", "handeye_cli", *words, "--json", "-q", "-o", "-"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
        text=True,
    )
    if done.returncode:
        sys.exit(f"FAILED {python}: handeye {' '.join(words)}: {done.stderr}")
    document = json.loads(done.stdout)
    error = document.get("predicted_error", {})
    is_chosen = "--optimize" in words
    return (
        {key: error[key] for key in ("rotation_mrad", "translation_mm")} if is_chosen else document
    )


def versions(python: str) -> str:
    """Return what a Python is made of, in a line."""
    program = (
        "import platform\nfrom importlib.metadata import version\n"
        f"print('Python', platform.python_version(), *(n + ' ' + version(n) for n in {PACKAGES}),"
        " sep=', ')"
    )
    done = subprocess.run([python, "-c", program], capture_output=True, text=True, check=True)
    return done.stdout.strip().replace(", ", " ", 1)


def numbers(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Yield every number, word and gap of a document with its path; provenance is none of them."""
    if isinstance(value, dict):
        for key, part in value.items():
            if key != "provenance":
                yield from numbers(part, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list):
        for k, part in enumerate(value):
            yield from numbers(part, f"{path}[{k}]")
    else:
        yield path, value


def words(value: object) -> object:
    """Return a text without its numbers; anything else as it is."""
    return NUMBER.sub("#", value) if isinstance(value, str) else value


def allowed(path: str, value: float, document: dict) -> float:
    """Return by how much a number may differ."""
    error = document.get("predicted_error") or {}
    if path.partition(".")[2].startswith("translation[") and "translation_mm" in error:
        return OF_PREDICTED * error["translation_mm"] / 1e3
    if path.partition(".")[2].startswith("quaternion[") and "rotation_mrad" in error:
        return OF_PREDICTED * error["rotation_mrad"] / 1e3
    return max(RELATIVE * abs(value), ABSOLUTE)


def differences(first: dict, other: dict) -> tuple[float, list[str]]:
    """Return the largest difference over what is allowed, and what is beyond it."""
    expected, found = dict(numbers(first)), dict(numbers(other))
    beyond = [f"only one has {path}" for path in expected.keys() ^ found.keys()]
    largest = 0.0
    for path in expected.keys() & found.keys():
        value, its = expected[path], found[path]
        if isinstance(value, float):
            share = abs(its - value) / allowed(path, value, first)
        else:
            share = 0.0 if words(value) == words(its) else float("inf")
        largest = max(largest, share)
        if share > 1.0:
            beyond.append(f"{path}: {value} and {its}")
    return largest, sorted(beyond)


def main(pythons: list[str]) -> None:
    """Compare all Pythons with the first."""
    if len(pythons) < 2:
        sys.exit(__doc__)
    documents = []
    for python in pythons:
        print(f"{python}: {versions(python)}", flush=True)
        documents.append({name: run(python, words) for name, words in COMMANDS.items()})
    failed = False
    for python, other in zip(pythons[1:], documents[1:], strict=True):
        for name, document in other.items():
            largest, beyond = differences(documents[0][name], document)
            failed |= bool(beyond)
            print(f"{'FAILED' if beyond else 'ok    '} {python}: {name}: {largest:.2g} of allowed")
            print(*(f"    {each}\n" for each in beyond[:10]), sep="", end="")
    if failed:
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
