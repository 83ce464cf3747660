"""A local scheduler and workers in separate processes, to be measured, killed and stopped."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from .cluster import LOG_LENGTH


class Processes:
    """A scheduler and workers that listen only on the loopback interface. folder: for their files and logs."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.address = f"tcp://127.0.0.1:{_free_port()}"
        self.scheduler = self.start_scheduler()
        self.workers: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        """Start a scheduler at the address, where an earlier one may have been."""
        port = self.address.rpartition(":")[2]
        return self._start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")

    def add_workers(self, count: int = 1, preload: Path | None = None, **variables: str) -> None:
        """Start `count` more workers, which are not restarted. preload: a module to load; variables: environment."""
        loaded = [] if preload is None else ["--preload", str(preload)]
        for _ in range(count):
            self.workers.append(
                self._start(
                    "distributed.cli.dask_worker",
                    self.address,
                    "--nthreads",
                    "1",
                    "--no-dashboard",
                    "--no-nanny",
                    "--host",
                    "127.0.0.1",
                    "--death-timeout",
                    "60",
                    *loaded,
                    **variables,
                )
            )

    def add_simulated(self, count: int) -> None:
        """Start a process with `count` simulated workers (simulated_workers.py)."""
        self.workers.append(self._start("clrt.farm.simulated_workers", self.address, str(count)))

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a process at once, as if its machine went down."""
        process.kill()
        process.wait()
        if process in self.workers:
            self.workers.remove(process)

    def _start(self, module: str, *arguments: str, **variables: str) -> subprocess.Popen[bytes]:
        log = open(self._folder / f"{module}-{time.monotonic_ns()}.log", "wb")
        environment = {
            **os.environ,
            "POCL_MAX_PTHREAD_COUNT": "1",
            "DASK_DISTRIBUTED__ADMIN__LOW_LEVEL_LOG_LENGTH": str(LOG_LENGTH),
            "DASK_TEMPORARY_DIRECTORY": str(self._folder),
            "PYTHONPATH": os.pathsep.join(sys.path),
            **variables,
        }
        return subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            cwd=self._folder,
            start_new_session=True,
        )

    def __enter__(self) -> Processes:
        """Wait until the scheduler listens, which takes long on a busy machine."""
        host, _, port = self.address.rpartition("/")[2].partition(":")
        while self.scheduler.poll() is None:
            with suppress(OSError), socket.create_connection((host, int(port)), 1):
                break
            time.sleep(0.05)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in [*self.workers, self.scheduler]:
            with suppress(ProcessLookupError):
                if sys.platform == "win32":
                    process.kill()
                else:
                    os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])
