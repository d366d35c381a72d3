"""Whole processes: how long a command takes from the shell to its end, over `import numpy`."""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.effort import Effort
from benchmarks.processes import ONE_THREAD, command_times
from benchmarks.solving.layouts import general_layout, noisy, perfect
from benchmarks.tables import Column, Table
from handeye_cli import Setup, write
from handeye_cli.records import Station, Stations, UncertainPose

POSES = 10
HANDEYE = ("-m", "handeye_cli")
UNIT = ("-c", "import numpy")
TIMES = (
    Column("process"),
    Column("processor [s]", ".3f"),
    Column("over numpy", ".2f"),
    Column("worst recording", ".2f"),
    Column("clock [s]", ".3f"),
    Column("clock over numpy", ".2f"),
)
NOTE = f"""Medians over alternating runs, with compiled modules, as an installation has them.
`solve` has a document of {POSES} poses without pictures, and the median is over several such
recordings: the noise in one of them may need a longer way, which is the worst recording."""
LEAST = 0.01
"""Share of a package that is listed by name."""
SHARES = (
    Column("package"),
    Column("modules", "d"),
    Column("import [ms]", ".1f"),
    Column("%", ".0f"),
)
PROFILE_NOTE = f"""What `solve` of {POSES} poses loads, by package, as `python -X importtime`
tells: each module without those that it loads itself. Measuring slows it down; the shares are
what counts. Work is what is not import: starting Python, reading, solving, writing."""


def write_recordings(folder: Path, effort: Effort) -> list[Path]:
    """Write documents of ten poses with different noise."""
    paths = []
    for k in range(effort.recordings):
        rng = np.random.default_rng([effort.seed, k])
        A, B, *_, of_camera = perfect(rng, general_layout, POSES)
        A, B = (poses[0] for poses in noisy(rng, A, B, of_camera, 1))
        stations = tuple(
            Station(f"{i:02d}", A[i], camera_T_target=UncertainPose(B[i])) for i in range(POSES)
        )
        paths.append(folder / f"{k}.yaml")
        write(Stations(Setup.EYE_IN_HAND, stations), str(paths[-1]))
    return paths


def measure(commands, runs: int, environment):
    """Seconds of the processor and of the clock, (inputs, runs, 2) by the name of the process."""
    taken = defaultdict(list)
    names = {name: len(inputs) for name, inputs in commands.items()}
    for run in range(-1, runs):
        for k in range(max(names.values())):
            for name, inputs in commands.items():
                words = inputs[k % len(inputs)]
                times = command_times([sys.executable, *words], environment)
                if run >= 0:  # the first one compiles
                    taken[name, k % len(inputs)].append(times)
    return {
        name: np.array([statistics_of(taken[name, k]) for k in range(count)])
        for name, count in names.items()
    }


def statistics_of(times):
    return [statistics.median(each) for each in zip(*times, strict=True)]


def row(name, medians, units):
    middle = np.median(medians, axis=0)
    worst = medians[:, 0].max() / units[0]
    return (name, middle[0], middle[0] / units[0], worst, middle[1], middle[1] / units[1])


def profile(path: Path, environment) -> list[tuple[str, int, float, float]]:
    """Rows of packages with their modules, milliseconds and percent."""
    command = [sys.executable, "-X", "importtime", *HANDEYE, "solve", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    spent, modules = Counter(), Counter()
    for own, name in re.findall(
        r"^import time: +(\d+) \| +\d+ \| +(\S+)$", done.stderr, re.MULTILINE
    ):
        package = home_of(name)
        spent[package] += int(own) / 1e3
        modules[package] += 1
    whole = sum(spent.values())
    small = [name for name, ms in spent.items() if ms < LEAST * whole]
    for counts in (spent, modules):
        counts["all others"] = sum(counts.pop(name) for name in small)
    return [(name, modules[name], ms, 100 * ms / whole) for name, ms in spent.most_common()]


def home_of(module: str) -> str:
    """The package of a module, and what of this project it belongs to."""
    first, _, rest = module.partition(".")
    if first in sys.stdlib_module_names:
        return "standard library"
    return f"handeye_cli.{rest.partition('.')[0]}" if first == "handeye_cli" and rest else first


def tables(effort: Effort) -> Iterator[Table]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = {**os.environ, **ONE_THREAD, "PYTHONPYCACHEPREFIX": name}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        recordings = write_recordings(folder, effort)
        commands = {
            "import numpy": [UNIT],
            "handeye --version": [(*HANDEYE, "--version")],
            "handeye --help": [(*HANDEYE, "--help")],
            "handeye solve --help": [(*HANDEYE, "solve", "--help")],
            f"handeye solve, {POSES} poses": [
                (*HANDEYE, "solve", str(path)) for path in recordings
            ],
        }
        medians = measure(commands, effort.runs, environment)
        units = medians["import numpy"][0]
        rows = [row(process, each, units) for process, each in medians.items()]
        yield Table("startup", "Start-up", TIMES, rows, NOTE)
        shares = profile(recordings[0], environment)
        title = "Start-up of solve: where the time of imports goes"
        yield Table("startup_profile", title, SHARES, shares, PROFILE_NOTE)
