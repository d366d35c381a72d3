"""Where many independent jobs are done at the same time: an explicit table of engines.

An engine takes a function and jobs, and yields what came of each as it ends. A job that raises, or
whose process dies, is a job that ended with a fault; the others go on. Leaving early, by `close` or
by Ctrl-C, ends what runs and forgets what has not started.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, Protocol, TypeVar, cast

ENGINES = {
    "processes": "handeye_cli.engines.processes",
    "dask": "handeye_cli.engines.dask",
}
"""Every engine by its name, with the module that holds its `engine(where)`."""

Given = TypeVar("Given")
Made = TypeVar("Made")


class WorkerDiedError(Exception):
    """Whoever did a job is gone; its text is a clause that says who, and why that may be."""


@dataclass(frozen=True)
class Ended(Generic[Made]):
    """A job that has come to its end.

    Attributes:
        index: Which of the jobs.
        result: What it returned, or None where it did not.
        fault: What it raised, or that its process died, or None.
    """

    index: int
    result: Made | None = None
    fault: BaseException | None = None


class Engine(Protocol):
    """Does jobs elsewhere."""

    def run(
        self, work: Callable[[Given], Made], jobs: Sequence[Given]
    ) -> Generator[Ended[Made], None, None]:
        """Yield every job's end, in the order they come.

        Args:
            work: A function of a module, which the other processes can import.
            jobs: Its arguments, which can be pickled, and so can its results.
        """
        ...


def engine_of(name: str, where: Any) -> Engine:
    """Return an engine.

    Args:
        name: A row of the table.
        where: What the engine needs: the number of processes, or the address of a scheduler.

    Raises:
        UsageError: What it needs is not installed.
        InputError: There is nobody at its address.
    """
    return cast(Engine, import_module(ENGINES[name]).engine(where))
