"""The cluster that renders: a Dask scheduler somewhere, or workers on this machine alone. All that knows Dask."""

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

from ..device.heap import keep_less
from ..errors import DeviceError, UsageError
from .remote import as_it_is
from .scheduler import check_scheduler

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

#: Seconds in which a scheduler must answer.
ANSWER = 10.0
#: Messages that a connection keeps for debugging.
LOG_LENGTH = 8
#: Results that are fetched at a time, and so at most in memory.
MOST_RESULTS = 16
#: Of workers' processes, what Dask's nannies say when one ends.
LAST_WORDS = ("was killed by", "exited with")
Result = concurrent.futures.Future[Any]
_log = logging.getLogger(__name__)


class Cluster:
    """A connection to a scheduler. Functions are sent to workers by address; how they ended is heard by `hear`."""

    def __init__(self, address: str, local: LocalCluster | None = None) -> None:
        keep_less()
        self.address, self._local = address, local
        self._held: dict[str, Future[Any]] = {}
        self._begin()
        self._client = self._connect()

    def _begin(self) -> None:
        """Nothing was sent yet."""
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
            raise DeviceError(f"the scheduler at {self.address} does not answer ({error}); start it with `dask "
                              "scheduler`, and name the address that it prints, not its dashboard's") from error

    @property
    def alive(self) -> bool:
        """Whether the scheduler is connected."""
        return self._client.status == "running"

    def reconnect(self) -> bool:
        """Whether a scheduler answers there again. What was sent to the one before is lost."""
        with suppress(Exception):   # there is nothing to be said to a connection that is broken
            self._client.close(timeout=1)
        try:
            self._client = self._connect()
        except DeviceError:
            return False
        self._held.clear()
        self._begin()
        return True

    def workers(self) -> dict[str, str]:
        """The names of those that are there, by address; as it was known last where there is no answer.

        The scheduler is asked itself: `Client.scheduler_info` may be overwritten by one without workers, which the
        client fetches every two seconds.
        """
        client = self._client
        with suppress(OSError):
            assert client.scheduler is not None
            found = client.sync(client.scheduler.identity, n_workers=-1, callback_timeout=ANSWER)["workers"]
            self._there = {address: str(about.get("name", address)) for address, about in found.items()}
        return self._there

    def put(self, arrays: dict[str, NDArray[Any]]) -> list[Future[Any]]:
        """Arrays that workers will take, each sent once: a task whose result they are, which Dask hands from worker
        to worker, and repeats where it was lost."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            for digest in arrays.keys() - self._held.keys():
                self._held[digest] = self._client.submit(as_it_is, arrays[digest], key=f"clrt-array-{digest}")
        return [self._held[digest] for digest in arrays]

    def keep_only(self, digests: set[str]) -> None:
        """Lets workers forget all other arrays."""
        for digest in self._held.keys() - digests:
            del self._held[digest]

    def send(self, worker: str, key: str, function: Callable[..., Any], *arguments: Any) -> None:
        """Has one worker call a function; futures among the arguments are what they stand for. How it ended is heard by
        its key, once the result is here."""
        heard = self._heard
        self._sent[key] = self._submit(worker, key, function, *arguments)
        self._sent[key].add_done_callback(lambda future: heard.put((key, None)))

    def forget(self, key: str) -> None:
        """What was sent under the key is not waited for any more."""
        self._sent.pop(key, None)
        self._coming.discard(key)

    def is_late(self, key: str) -> None:
        """Others do what was sent under the key: if it is on its way, it keeps nothing else from coming."""
        self._coming.discard(key)

    def hear(self, seconds: float) -> list[tuple[str, Result]]:
        """Keys and results of what ended since; waits for the first of them. There are never more than MOST_RESULTS
        here, however many workers there are."""
        ended: list[tuple[str, Result]] = []
        with suppress(Empty):
            self._take_in(*self._heard.get(timeout=seconds), ended)
            while True:
                self._take_in(*self._heard.get_nowait(), ended)
        while self._waiting and len(self._coming) < MOST_RESULTS:
            self._fetch(self._waiting.popleft())
        return ended

    def _take_in(self, key: str, result: Result | None, ended: list[tuple[str, Result]]) -> None:
        """Something is done there, or its result is here."""
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
        """What will be the function's answer there (`remote.Answer`), unless the worker ends before."""
        return self._submit(worker, key, function, *arguments)

    def _submit(self, worker: str, key: str, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._client.submit(function, *arguments, key=key, workers=[worker], pure=False)

    def last_words(self) -> str:
        """What is known of how worker processes ended lately."""
        try:
            logs = self._client.get_worker_logs(n=50, nanny=True)
        except Exception:    # a help for people, which may fail in any way
            return ""
        lines = [line for entries in logs.values() for _, line in entries if any(word in line for word in LAST_WORDS)]
        return f" ({lines[0].strip().splitlines()[-1]})" if lines else ""

    def close(self) -> None:
        """Leaves the scheduler, and ends what was started for this cluster."""
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
    """The result of what is done, by itself: `Client.gather` joins requests, and then one worker that hangs keeps the
    results of all others back."""
    if future.status != "finished":
        return await client.gather(future, asynchronous=True)    # raises what is wrong
    assert client.scheduler is not None    # as long as it is connected
    found = await client.scheduler.gather(keys=[future.key])
    if found["status"] != "OK":
        raise ConnectionError("its worker has not got it any more")
    return found["data"][future.key]


def connect(address: str) -> Cluster:
    """A cluster by its scheduler's address, tcp://… or tls://…, with the certificates of Dask's own settings."""
    _check_dask()
    if "://" not in address or not address.partition("://")[2]:
        raise UsageError(f"--scheduler {address}: is no address; write tcp://HOST:PORT or tls://HOST:PORT, as the "
                         "scheduler prints it")
    return Cluster(address)


def local_cluster(count: int) -> Cluster:
    """So many workers on this machine, each with its share of the processors, which nothing else can speak to: their
    ports are of the loopback interface, and their certificates live in memory."""
    _check_dask()
    if count < 1:
        raise UsageError(f"--local-cluster {count}: there must be a worker")
    from distributed import LocalCluster

    threads = max(1, (os.cpu_count() or 1) // count)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        local = LocalCluster(n_workers=count, threads_per_worker=1, host="127.0.0.1", dashboard_address=None,
                             worker_dashboard_address=None, security=True, silence_logs=logging.ERROR,
                             env={"POCL_MAX_PTHREAD_COUNT": str(threads)})
    return Cluster(local.scheduler_address, local)


def _check_dask() -> None:
    try:
        import cryptography  # noqa: F401
        import dask
        import distributed  # noqa: F401
    except ImportError:
        raise UsageError("a farm needs Dask: pip install distributed cryptography") from None
    # Else each connection keeps its last thousand messages, with all that was in them.
    dask.config.set({"distributed.admin.low-level-log-length": LOG_LENGTH})
    for name in ("distributed", "distributed.client"):    # Dask gives the latter a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)
