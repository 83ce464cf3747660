"""Standard streams that are closed, or cannot be written, end no work: what is to be written to files is written."""

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
    """What is beneath a stream; its first failure is kept, and it takes and forgets all that follows."""

    def __init__(self, stream: TextIO) -> None:
        self.failure: OSError | None = None
        self._stream = stream   # else garbage collection would close the file
        self._raw: Any = getattr(stream.buffer, "raw", stream.buffer)

    def write(self, data: ReadableBuffer, /) -> int | None:
        """See io.RawIOBase; raises nothing."""
        if self.failure is None:
            try:
                written: int | None = self._raw.write(data)
                return written
            except OSError as error:
                self.failure = error
        return memoryview(data).nbytes

    def writable(self) -> bool:
        """Yes."""
        return True

    def fileno(self) -> int:
        """Of the file beneath."""
        return int(self._raw.fileno())

    def isatty(self) -> bool:
        """Of the file beneath."""
        return bool(self._raw.isatty())


def open_missing() -> None:
    """Opens the null device for each of standard output and error that is closed, in whose place the next file that is
    opened would be, and get what is printed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8", closefd=False))


def show_names() -> None:
    """Has standard error show file names that are not UTF-8 as `printable` has them."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr.reconfigure(errors=SHOWN)


def tell(line: str) -> None:
    """Prints it on standard error, unless nobody is there any more, such as a terminal that was closed."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


def patient_stdout() -> _Patient:
    """Has standard output raise no errors any more; returns what keeps the first.

    What its encoding lacks is written as an escape. A console of Windows stays one, which takes any text. ASCII becomes
    UTF-8: click writes that there, with a "?" for each byte of a file name that is not UTF-8.
    """
    sys.stdout.flush()
    encoding = codecs.lookup(sys.stdout.encoding).name
    patient = _Patient(sys.stdout)
    sys.stdout = io.TextIOWrapper(io.BufferedWriter(patient), "utf-8" if encoding == "ascii" else encoding, AS_BYTES,
                                  line_buffering=sys.stdout.isatty())
    return patient


def stdout_problem(patient: _Patient) -> str:
    """What is to be told of it: empty where all was written, or whoever read it has gone."""
    sys.stdout.flush()
    failure = patient.failure
    if failure is None or failure.errno == errno.EPIPE:
        return ""
    return f"standard output cannot be written ({failure.strerror}); free some space there or redirect it elsewhere"
