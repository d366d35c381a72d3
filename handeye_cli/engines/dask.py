"""Jobs on a Dask cluster, whose scheduler hands them out; needs the extra `cluster`."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from handeye_cli.engines import Ended, Given, Made, WorkerDiedError
from handeye_cli.errors import InputError, UsageError

_PATIENCE = "10s"
"""How long a scheduler may take to answer."""
_DIED = "the workers that worked on it died one after another, as when memory runs out"
_GIVEN_UP = "the cluster gave it up, as when its scheduler ends"


def engine(scheduler: str) -> DaskCluster:
    """Return the engine behind the address of a scheduler.

    Raises:
        UsageError: The extra is not installed.
    """
    _distributed()
    return DaskCluster(scheduler)


@dataclass(frozen=True)
class DaskCluster:
    """An `Engine` on the workers of a cluster.

    Attributes:
        scheduler: Its address, such as `tcp://10.0.0.5:8786`.
    """

    scheduler: str

    def run(
        self, work: Callable[[Given], Made], jobs: Sequence[Given]
    ) -> Generator[Ended[Made], None, None]:
        """Yield every job's end, in the order they come; see `Engine`.

        A worker cannot be stopped within a job: what runs when this is left early runs to its end,
        and is forgotten.

        Raises:
            InputError: There is no scheduler at the address.
        """
        with _client(self.scheduler) as client:
            # without purity two recordings of one content would be one job
            numbers = {client.submit(work, job, pure=False): i for i, job in enumerate(jobs)}
            futures = _distributed().as_completed(list(numbers), loop=client.loop)
            for future in futures:
                yield _ended(numbers.pop(future), future)


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    """Yield a client, whose end releases all that it has asked for."""
    try:
        # a client that never had a valid address complains once more when it is thrown away
        import_module("distributed.comm").get_address_host(scheduler)
        client = _distributed().Client(scheduler, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"expected a Dask scheduler, found none that answers: {error}",
            where=f"--scheduler {scheduler}",
            hint="its address looks like tcp://10.0.0.5:8786",
        ) from error
    with client:
        yield client


def _ended(index: int, future: Any) -> Ended[Any]:
    if future.cancelled():
        return Ended(index, fault=WorkerDiedError(_GIVEN_UP))
    fault = future.exception()
    if isinstance(fault, _distributed().KilledWorker):
        fault = WorkerDiedError(_DIED)
    return Ended(index, None if fault else future.result(), fault)


def _distributed() -> Any:
    """Return Dask's library, which is loaded only when a cluster is asked for."""
    try:
        return import_module("distributed")
    except ModuleNotFoundError as error:
        raise UsageError(
            "--scheduler needs Dask, which is not installed",
            hint="pip install 'handeye-cli[cluster]', here and on the workers",
        ) from error
