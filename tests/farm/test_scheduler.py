"""Connecting to an address without a scheduler raises an error in time that names the address."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from random import Random

import pytest

from clrt.errors import DeviceError
from clrt.farm import cluster
from clrt.farm.cluster import connect
from clrt.farm.local_processes import Processes
from clrt.threads import Event, beside

#: Timeout in seconds.
SHORT = 1.5


@contextmanager
def server(answer: bytes | None) -> Iterator[str]:
    """Yield the address of a server that sends `answer` and closes each connection; with None it never answers."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        kept = []

        def serve() -> None:
            while True:
                try:
                    connection, _ = listening.accept()
                except OSError:
                    return
                kept.append(connection)
                if answer is not None:
                    connection.sendall(answer)
                    connection.shutdown(socket.SHUT_WR)

        beside(serve, daemon=True)
        yield f"127.0.0.1:{listening.getsockname()[1]}"
        for connection in kept:
            connection.close()


def refused(address: str) -> str:
    """Return the error message for an address; it must name the address once."""
    with pytest.raises(DeviceError) as error:
        connect(address)
    assert str(error.value).count(address) == 1 and "use the address that it prints" in str(error.value)
    return str(error.value)


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "ANSWER", SHORT)


@pytest.mark.parametrize("scheme", ["tcp", "tls"])
@pytest.mark.parametrize(
    "answer",
    [
        None,
        b"",
        b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n",
        b"SSH-2.0-OpenSSH_9.6\r\n",
        bytes(64),
        b"\xff" * 64,
        *map(Random(1).randbytes, (7, 8, 9, 40)),
    ],
)
def test_other_servers(answer: bytes | None, scheme: str) -> None:
    with server(answer) as address:
        refused(f"{scheme}://{address}")


def test_ports_that_drop_connections() -> None:
    """The listen queue is full, so the system does not answer further connections."""
    with ExitStack() as stack:
        full = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(4):
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(full.getsockname())
        assert "no answer within" in refused(f"tcp://127.0.0.1:{full.getsockname()[1]}")


def test_hosts_without_a_name() -> None:
    refused("tcp://nowhere.invalid:8786")


def test_a_lookup_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A resolver that never answers cannot be interrupted."""
    monkeypatch.setattr(socket, "getaddrinfo", lambda *arguments, **options: Event().wait(30))
    assert "no answer within" in refused("tcp://nowhere.invalid:8786")


def test_a_worker_is_no_scheduler(tmp_path: Path) -> None:
    with Processes(tmp_path) as processes:
        processes.add_workers(1)
        cluster.ANSWER = 10.0  # restored by the fixture
        with connect(processes.address) as connected:
            while not (workers := connected.workers()):
                pass
            assert "a Dask worker answers, not a scheduler" in refused(next(iter(workers)))
