"""A Dask cluster of one worker in this process, behind a TCP address as any other."""

from contextlib import contextmanager

import pytest


@contextmanager
def small_cluster():
    """Yield the address of a scheduler; skip without the extra."""
    distributed = pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        protocol="tcp://",
        dashboard_address=None,
    ) as cluster:
        yield cluster.scheduler_address
