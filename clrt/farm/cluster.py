"""The cluster that renders: a remote Dask scheduler, or workers on this machine only. All code that depends on Dask."""

from __future__ import annotations

import concurrent.futures
import logging
import os
import warnings
from asyncio import AbstractEventLoop, run_coroutine_threadsafe
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ..device.malloc_trim import keep_less
from ..errors import DeviceError, UsageError
from .scheduler import check_scheduler
from .worker_tasks import as_it_is

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

#: Seconds within which a scheduler must answer.
ANSWER = 10.0
#: Messages that a connection keeps for debugging.
LOG_LENGTH = 8
#: Maximum number of results fetched at a time, and so in memory.
MOST_RESULTS = 16
#: Log messages of Dask's nannies when a worker process ends.
LAST_WORDS = ("was killed by", "exited with")
Result = concurrent.futures.Future[Any]
_log = logging.getLogger(__name__)


class Cluster:
    """A connection to a scheduler. `send` calls functions on workers by address; `hear` returns their results."""

    def __init__(self, address: str, local: LocalCluster | None = None) -> None:
        keep_less()
        self.address, self._local = address, local
        self._held: dict[str, Future[Any]] = {}
        self._begin()
        self._client = self._connect()

    def _begin(self) -> None:
        """Reset to the state in which nothing was sent."""
        self._heard: SimpleQueue[tuple[str, Result | None]] = SimpleQueue()
        self._sent: dict[str, Future[Any]] = {}
        self._waiting: deque[str] = deque()
        self._coming: set[str] = set()
        self._there: dict[str, str] = {}

    def _connect(self) -> Client:
        from distributed import Client

        try:
            if self._local is None:
                check_scheduler(self.address, ANSWER)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return Client(self._local or self.address, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise DeviceError(
                f"the scheduler at {self.address} does not answer ({error}); start it with `dask "
                "scheduler`, and use the address that it prints, not the dashboard's"
            ) from error

    @property
    def alive(self) -> bool:
        """Return whether the scheduler is connected."""
        return self._client.status == "running"

    def reconnect(self) -> bool:
        """Return whether a scheduler answers at the address again. What was sent to the previous one is lost."""
        with suppress(Exception):  # the connection is already broken
            self._client.close(timeout=1)
        try:
            self._client = self._connect()
        except DeviceError:
            return False
        self._held.clear()
        self._begin()
        return True

    def workers(self) -> dict[str, str]:
        """Return the names of the connected workers by address; the last known ones if the scheduler does not answer.

        The scheduler is queried directly: `Client.scheduler_info` may be overwritten by a reply without workers, which
        the client fetches every two seconds.
        """
        client = self._client
        with suppress(OSError):
            assert client.scheduler is not None
            found = client.sync(client.scheduler.identity, n_workers=-1, callback_timeout=ANSWER)["workers"]
            self._there = {address: str(about.get("name", address)) for address, about in found.items()}
        return self._there

    def put(self, arrays: dict[str, NDArray[Any]]) -> list[Future[Any]]:
        """Return futures of arrays for workers, each sent once.

        Each is the result of a task, so Dask copies it from worker to worker, and recomputes it if it is lost.
        """
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            for digest in arrays.keys() - self._held.keys():
                self._held[digest] = self._client.submit(as_it_is, arrays[digest], key=f"clrt-array-{digest}")
        return [self._held[digest] for digest in arrays]

    def keep_only(self, digests: set[str]) -> None:
        """Let workers release all other arrays."""
        for digest in self._held.keys() - digests:
            del self._held[digest]

    def send(self, worker: str, key: str, function: Callable[..., Any], *arguments: Any) -> None:
        """Have one worker call a function; futures among the arguments are replaced by their results.

        `hear` returns the outcome under `key` once the result has arrived.
        """
        heard = self._heard
        self._sent[key] = self._submit(worker, key, function, *arguments)
        self._sent[key].add_done_callback(lambda future: heard.put((key, None)))

    def forget(self, key: str) -> None:
        """Stop waiting for what was sent under the key."""
        self._sent.pop(key, None)
        self._coming.discard(key)

    def is_late(self, key: str) -> None:
        """Let a late result no longer count as being fetched, so that it holds back no others: its task is repeated."""
        self._coming.discard(key)

    def hear(self, seconds: float) -> list[tuple[str, Result]]:
        """Return keys and results of what has ended since; wait at most `seconds` for the first of them.

        There are never more than MOST_RESULTS in memory, regardless of the number of workers.
        """
        ended: list[tuple[str, Result]] = []
        with suppress(Empty):
            self._take_in(*self._heard.get(timeout=seconds), ended)
            while True:
                self._take_in(*self._heard.get_nowait(), ended)
        while self._waiting and len(self._coming) < MOST_RESULTS:
            self._fetch(self._waiting.popleft())
        return ended

    def _take_in(self, key: str, result: Result | None, ended: list[tuple[str, Result]]) -> None:
        """Process a notification: a task has ended there, or its result has arrived."""
        if result is None:
            self._waiting.append(key)
            return
        self.forget(key)
        ended.append((key, result))

    def _fetch(self, key: str) -> None:
        if (future := self._sent.get(key)) is None:
            return
        client, heard = self._client, self._heard
        loop: AbstractEventLoop = getattr(client.loop, "asyncio_loop")
        self._coming.add(key)
        coming = run_coroutine_threadsafe(_fetched(client, future), loop)
        coming.add_done_callback(lambda result: heard.put((key, result)))

    def ask(self, worker: str, key: str, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Return a future of the function's answer (`remote.Answer`) on that worker; it fails if the worker ends."""
        return self._submit(worker, key, function, *arguments)

    def _submit(self, worker: str, key: str, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._client.submit(function, *arguments, key=key, workers=[worker], pure=False)

    def last_words(self) -> str:
        """Return what the logs say about worker processes that ended recently."""
        try:
            logs = self._client.get_worker_logs(n=50, nanny=True)
        except Exception:  # only a hint for the user, which may fail in any way
            return ""
        lines = [line for entries in logs.values() for _, line in entries if any(word in line for word in LAST_WORDS)]
        return f" ({lines[0].strip().splitlines()[-1]})" if lines else ""

    def close(self) -> None:
        """Disconnect from the scheduler, and end the local cluster if there is one."""
        with suppress(Exception):
            self._client.close(timeout=5)
        if self._local is not None:
            with suppress(Exception):
                self._local.close(timeout=5)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


async def _fetched(client: Client, future: Future[Any]) -> Any:
    """Return the result of a finished task, fetched separately.

    `Client.gather` batches requests, so one worker that hangs would hold back the results of all others.
    """
    if future.status != "finished":
        return await client.gather(future, asynchronous=True)  # raises the task's error
    assert client.scheduler is not None  # while it is connected
    found = await client.scheduler.gather(keys=[future.key])
    if found["status"] != "OK":
        raise ConnectionError("its worker no longer has it")
    return found["data"][future.key]


def connect(address: str) -> Cluster:
    """Connect to the scheduler at tcp://… or tls://…, with the certificates from Dask's settings."""
    _check_dask()
    if "://" not in address or not address.partition("://")[2]:
        raise UsageError(
            f"--scheduler {address}: is not an address; write tcp://HOST:PORT or tls://HOST:PORT, as the "
            "scheduler prints it"
        )
    return Cluster(address)


def local_cluster(count: int) -> Cluster:
    """Start this many workers on this machine, each with its share of the CPUs, isolated from other programs.

    They listen only on the loopback interface, and their certificates exist only in memory.
    """
    _check_dask()
    if count < 1:
        raise UsageError(f"--local-cluster {count}: must be at least 1")
    from distributed import LocalCluster

    threads = max(1, (os.cpu_count() or 1) // count)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        local = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
            worker_dashboard_address=None,
            security=True,
            silence_logs=logging.ERROR,
            env={"POCL_MAX_PTHREAD_COUNT": str(threads)},
        )
    return Cluster(local.scheduler_address, local)


def _check_dask() -> None:
    try:
        import cryptography  # noqa: F401
        import dask
        import distributed  # noqa: F401
    except ImportError:
        raise UsageError("rendering on workers needs Dask: pip install distributed cryptography") from None
    # By default each connection keeps its last thousand messages with their contents.
    dask.config.set({"distributed.admin.low-level-log-length": LOG_LENGTH})
    for name in ("distributed", "distributed.client"):  # Dask sets a level for the latter
        logging.getLogger(name).setLevel(logging.CRITICAL)
