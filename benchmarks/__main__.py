"""Run the benchmarks, print their tables, and write them as `performance.md` and `.json`.

python -m benchmarks                                everything, into docs/
python -m benchmarks --quick                        a smoke test, which writes nothing
python -m benchmarks extraction.detection --sizes vga --views 1000 --lost
python -m benchmarks solving.accuracy --trials 2000 --seed 2
python -m benchmarks mcap --gigabytes 5 --layouts zstd,chunks,no-crc,unchunked
"""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from importlib import import_module
from pathlib import Path

from benchmarks import page
from benchmarks.effort import FULL, QUICK, Effort
from benchmarks.tables import Table

TOPICS = {
    "extraction": ("detection", "accuracy", "boards", "real", "memory"),
    "solving": ("accuracy", "scaling"),
    "planning": (),
    "mcap": (),
    "startup": (),
}
"""Every topic, with its parts where it has any."""
_FOLDER = Path(__file__).resolve().parents[1] / "docs"


def modules(wanted: Sequence[str]) -> list[str]:
    """Return the modules of topics and parts, in their order."""
    known = [
        name
        for topic, parts in TOPICS.items()
        for name in ([f"{topic}.{part}" for part in parts] or [topic])
    ]
    chosen = [name for name in known if {name, name.partition(".")[0]} & set(wanted)]
    if strange := set(wanted) - set(known) - set(TOPICS):
        raise SystemExit(f"expected topics of {', '.join(TOPICS)}, found {', '.join(strange)}")
    return chosen if wanted else known


def tables(names: Sequence[str], effort: Effort) -> Iterator[tuple[str, Table]]:
    """Yield the name of each module with its tables, as they are measured."""
    for name in names:
        for table in import_module(f"benchmarks.{name}").tables(effort):
            yield name, table


def main() -> None:
    options = _parser().parse_args()
    preset = QUICK if options.quick else FULL
    given = {each.name: getattr(options, each.name) for each in fields(Effort)}
    effort = Effort(
        **{key: getattr(preset, key) if value is None else value for key, value in given.items()}
    )
    names, results = modules(options.topics), {}
    for name, table in tables(names, effort):
        results[table.key] = table
        print(f"[{name}] {table.text()}\n", flush=True)
    whole = not (options.topics or options.quick)
    folder = options.out or (_FOLDER if whole else None)
    if folder is not None:
        page.write(folder, results, effort)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=", ".join(modules(())))
    parser.add_argument("--quick", action="store_true", help="see that all of it runs")
    parser.add_argument("--out", type=Path, help="folder for the results")
    meanings = _meanings()
    for each in fields(Effort):
        kind = {"action": argparse.BooleanOptionalAction} if each.type == "bool" else {}
        typed = {} if kind else {"type": type(each.default)}
        text = f"{meanings[each.name]} ({each.default})".replace("%", "%%")
        parser.add_argument(f"--{each.name}", default=None, help=text, **kind, **typed)
    return parser


def _meanings() -> Mapping[str, str]:
    """Return what the docstring says of each field."""
    lines = inspect.getdoc(Effort).partition("Attributes:\n")[2].splitlines()
    pairs = [line.strip().partition(": ") for line in lines]
    return {name: text.rstrip(".") for name, _, text in pairs}


if __name__ == "__main__":
    main()
