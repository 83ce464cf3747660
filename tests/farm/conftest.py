"""What tests of a farm have in common; each has scheduler and workers of its own, `processes`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from clrt.farm.cluster import Cluster, connect
from clrt.farm.local_processes import Processes


@pytest.fixture
def cluster(processes: Processes) -> Iterator[Cluster]:
    with connect(processes.address) as connected:
        yield connected
