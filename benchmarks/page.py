"""The results as files: a page for people and the numbers for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from benchmarks import machine
from benchmarks.effort import Effort
from benchmarks.tables import Table

_HEAD = """# Performance

Written by `python -m benchmarks`, which measures everything in one run, side by side: this
project, OpenCV, and what no method can do better. `performance.json` has the same numbers. Times
are those of one processor core unless a table says otherwise, and depend on the machine; ratios
hardly do."""
_LEFT_OUT = ("data", "folder", "lost")
"""What says where something lies on this machine, or changes no number."""


def write(folder: Path, results: Mapping[str, Table], effort: Effort) -> None:
    """Write `performance.md` and `performance.json` into a folder."""
    sizes = {name: value for name, value in asdict(effort).items() if name not in _LEFT_OUT}
    known = {"machine": machine.facts(), "effort": sizes}
    tables = {key: table.as_json() for key, table in results.items()}
    text = json.dumps(known | {"tables": tables}, indent=1, allow_nan=False)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "performance.json").write_text(text + "\n", encoding="utf-8")
    lists = [_list("Machine", known["machine"]), _list("Sizes of the benchmarks", sizes)]
    parts = [_HEAD, *lists, *(table.markdown() for table in results.values())]
    (folder / "performance.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _list(title: str, facts: Mapping[str, object]) -> str:
    rows = [f"| {name} | {value} |" for name, value in facts.items()]
    return "\n".join([f"### {title}", "", "| | |", "|---|---|", *rows])
