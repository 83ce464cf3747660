"""Addresses where no scheduler is end in one message that names them, however what is there behaves."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np
import pytest

from clrt.errors import DeviceError
from clrt.farm.cluster import connect
from clrt.threads import beside

NOISE = np.random.default_rng(11).bytes
#: What a server answers to what it is sent.
ANSWERS: dict[str, Callable[[bytes], bytes]] = {
    "nothing": lambda sent: b"", "itself": lambda sent: sent, "noise": lambda sent: NOISE(4096),
    "a web page": lambda sent: b"HTTP/1.0 400 Bad Request\r\nContent-Length: 3\r\n\r\nBad",
    "a few bytes": lambda sent: NOISE(5)}


@pytest.fixture
def server(request: pytest.FixtureRequest) -> Iterator[str]:
    """The address of one that answers so, and keeps connections open."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        with suppress(OSError):
            while True:
                connection, _ = listener.accept()
                beside(lambda: answer(connection), daemon=True)

    def answer(connection: socket.socket) -> None:
        with suppress(OSError):
            while sent := connection.recv(1 << 16):
                connection.sendall(ANSWERS[request.param](sent))

    beside(serve, daemon=True)
    yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
    listener.close()


@pytest.mark.parametrize("server", ANSWERS, indirect=True)
def test_something_else_answers(server: str) -> None:
    with pytest.raises(DeviceError, match=f"no scheduler answers at {server}.*start it with `dask scheduler`"):
        connect(server)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "tcp://no-such-host.invalid:8786", "udp://127.0.0.1:8786"])
def test_nothing_is_there(address: str) -> None:
    with pytest.raises(DeviceError, match=f"no scheduler answers at {address}"):
        connect(address)
