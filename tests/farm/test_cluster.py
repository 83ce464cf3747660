"""Messages to and from workers, without rendering."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import dask
import pytest

from clrt.farm.cluster import Cluster, connect
from clrt.farm.local_processes import Processes
from clrt.farm.worker_tasks import as_it_is


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    with Processes(tmp_path) as started:
        started.add_workers(2)
        yield started


def addresses(cluster: Cluster, count: int) -> list[str]:
    """Wait for `count` workers and return their addresses."""
    while len(found := cluster.workers()) < count:
        time.sleep(0.05)
    return list(found)


def heard(cluster: Cluster, keys: set[str], seconds: float = 30) -> set[str]:
    """Return which of the keys have been heard of within `seconds`."""
    found, end = set[str](), time.monotonic() + seconds
    while not keys <= found and time.monotonic() < end:
        found |= {key for key, _ in cluster.hear(0.1)}
    return found


def test_who_hangs_keeps_no_other_result_back(processes: Processes) -> None:
    """A worker that is suspended after it reported its result does not delay results of others."""
    with connect(processes.address) as cluster:
        one, other = addresses(cluster, 2)
        pids = {address: cluster._submit(address, f"pid-{address}", os.getpid).result() for address in (one, other)}
        cluster.send(one, "of-one", as_it_is, b"1" * 100_000)
        cluster.send(other, "of-other", as_it_is, b"2" * 100_000)
        while cluster._heard.qsize() < 2:
            time.sleep(0.01)
        os.kill(pids[one], signal.SIGSTOP)
        try:
            assert heard(cluster, {"of-other"}) == {"of-other"}
        finally:
            os.kill(pids[one], signal.SIGCONT)
        assert heard(cluster, {"of-one"}) == {"of-one"}


def test_those_that_are_there_are_seen(processes: Processes) -> None:
    """Workers are listed at every call, also while Dask's client updates its own information."""
    with dask.config.set({"distributed.client.scheduler-info-interval": "1ms"}), connect(processes.address) as cluster:
        addresses(cluster, 2)
        assert {len(cluster.workers()) for _ in range(300)} == {2}
