"""Tolerance of standard streams that are closed or cannot be written: files are still written."""

from __future__ import annotations

import codecs
import errno
import io
import os
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TextIO

from ..file_names import AS_BYTES, SHOWN

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class _Patient(io.RawIOBase):
    """Raw stream that stores its first failure, and discards everything that is written afterwards."""

    def __init__(self, stream: TextIO) -> None:
        self.failure: OSError | None = None
        self._stream = stream  # otherwise garbage collection would close the file
        self._raw: Any = getattr(stream.buffer, "raw", stream.buffer)

    def write(self, data: ReadableBuffer, /) -> int | None:
        """Write data, or discard it after a failure; raises nothing."""
        if self.failure is None:
            try:
                written: int | None = self._raw.write(data)
                return written
            except OSError as error:
                self.failure = error
        return memoryview(data).nbytes

    def writable(self) -> bool:
        """Return True."""
        return True

    def fileno(self) -> int:
        """Return the descriptor of the underlying file."""
        return int(self._raw.fileno())

    def isatty(self) -> bool:
        """Return whether the underlying file is a terminal."""
        return bool(self._raw.isatty())


def open_missing() -> None:
    """Open the null device for standard output and error if closed: otherwise the next file opened would get their
    descriptor, and receive what is printed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8", closefd=False))


def show_names() -> None:
    """Make standard error show file names that are not UTF-8 like `printable`."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr.reconfigure(errors=SHOWN)


def tell(line: str) -> None:
    """Print a line on standard error; a closed terminal is ignored."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


def patient_stdout() -> _Patient:
    """Make standard output raise no more errors; return the stream that stores the first.

    Characters that its encoding lacks are written as escapes. A Windows console stays a console, which accepts any
    text. ASCII becomes UTF-8, which click writes then, with a "?" for each byte of a file name that is not UTF-8.
    """
    sys.stdout.flush()
    encoding = codecs.lookup(sys.stdout.encoding).name
    patient = _Patient(sys.stdout)
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(patient),
        "utf-8" if encoding == "ascii" else encoding,
        AS_BYTES,
        line_buffering=sys.stdout.isatty(),
    )
    return patient


def stdout_problem(patient: _Patient) -> str:
    """Return the error to report: empty if all was written, or if the reader has closed the pipe."""
    sys.stdout.flush()
    failure = patient.failure
    if failure is None or failure.errno == errno.EPIPE:
        return ""
    return f"standard output cannot be written ({failure.strerror}); free some space there or redirect it elsewhere"
