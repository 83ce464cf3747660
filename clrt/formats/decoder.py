"""Decoding of images, compressed meshes, 3MF and USD files in a child process, since the libraries may crash, hang or
exhaust memory if a file is damaged.

The process starts with the first file, is reused for later ones, and exits after being idle for a while.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from signal import strsignal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..awake import wait_awake
from ..errors import SceneError
from ..file_names import utf8_path
from ..threads import Event, beside

#: Time limit per file in seconds. The largest supported image takes a tenth of it.
LIMIT = 60.0
Arrays = dict[str, NDArray[Any]]

_lock = threading.Lock()
_running: _Process | None = None


def decode(kind: str, source: Path | bytes, suffix: str = "", **options: Any) -> tuple[Arrays, dict[str, Any]]:
    """Decode a file, or bytes of a file with the name suffix `suffix`, and return its arrays and other facts.

    kind: one of decoder_process.DECODERS, whose function also gets the options. Raises SceneError with its message, or
    with how the process ended.
    """
    try:
        if isinstance(source, Path):
            with utf8_path(source.absolute()) as path:
                return _decoded([kind, str(path), options])
        with tempfile.TemporaryDirectory(prefix="clrt-") as folder:
            file = Path(folder) / f"embedded{suffix}"
            file.write_bytes(source)
            return decode(kind, file, **options)
    except OSError as error:
        raise SceneError(
            f"the system cannot provide a process or a temporary file for the decoder ({error.strerror or error})"
        ) from error


def _decoded(request: list[Any]) -> tuple[Arrays, dict[str, Any]]:
    global _running
    with _lock:
        while True:
            reused = _running if _running is not None and _running.owner == os.getpid() else None
            _running = process = reused or _Process()
            try:
                return process.decode(request)
            except _Ended as end:
                _running = None
                if reused is None or end.late:  # otherwise it may merely have exited after being idle
                    raise SceneError(f"the decoder {end}; the file is damaged or too large") from None


class _Ended(Exception):
    """The decoder process has ended; the message says how. late: whether it was killed, since it took too long."""

    def __init__(self, how: str, late: bool) -> None:
        super().__init__(how)
        self.late = late


class _Process:
    """Child process that runs decoder_process. `owner`: the pid that started it; a forked process must not use it."""

    def __init__(self) -> None:
        import subprocess  # most scenes need no decoder

        path = os.pathsep.join(os.path.abspath(folder) for folder in sys.path)
        self.owner = os.getpid()
        self._popen = subprocess.Popen(
            [sys.executable, "-P", "-m", "clrt.formats.decoder_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        )
        assert self._popen.stdin and self._popen.stdout
        self._requests, self._replies = self._popen.stdin, self._popen.stdout

    def decode(self, request: list[Any]) -> tuple[Arrays, dict[str, Any]]:
        """Decode a file, [kind, file, options], see `decode` of the module.

        Raises _Ended if the process ends or has to be killed.
        """
        ended, late = Event(), Event()

        def watch() -> None:
            if not wait_awake(ended, LIMIT):
                late.set()
                self._popen.kill()

        beside(watch, daemon=True)
        try:
            self._requests.write(json.dumps(request).encode() + b"\n")
            self._requests.flush()
            reply = json.loads(self._replies.readline() or "null")
            if reply is None:
                raise EOFError
            arrays = {name: self._array(shape, dtype) for name, (shape, dtype) in reply["arrays"].items()}
        except (OSError, EOFError):
            how = f"took more than {LIMIT:g} s" if late.is_set() else self._how_it_ended()
            raise _Ended(how, late.is_set()) from None
        except BaseException:  # e.g. KeyboardInterrupt: later replies would not match their requests
            self._popen.kill()
            raise
        finally:
            ended.set()
        if "error" in reply:
            raise SceneError(reply["error"])
        return arrays, reply["facts"]

    def _array(self, shape: list[int], dtype: str) -> NDArray[Any]:
        array = np.empty(shape, dtype)
        view = array.reshape(-1).view(np.uint8).data
        while len(view):
            count = self._replies.readinto(view)  # type: ignore[attr-defined]
            if not count:
                raise EOFError
            view = view[count:]
        return array

    def _how_it_ended(self) -> str:
        self._popen.kill()  # no effect if it has already ended; the exit code then is its own
        with suppress(OSError):
            self._requests.close()
        self._replies.close()
        code = self._popen.wait()
        return f"crashed with signal {-code} ({strsignal(-code)})" if code < 0 else f"ended with code {code}"
