"""Shared fixtures of the farm tests; each module defines its own scheduler and workers, `processes`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from clrt.farm.cluster import Cluster, connect
from clrt.farm.local_processes import Processes


@pytest.fixture
def cluster(processes: Processes) -> Iterator[Cluster]:
    with connect(processes.address) as connected:
        yield connected
