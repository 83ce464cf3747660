"""Standard streams that are closed, or cannot be written, end no work: what is to be written to files is written."""

from __future__ import annotations

import errno
import io
import os
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class _Patient(io.FileIO):
    """A file whose first failure is kept, and which takes and forgets all that follows."""

    failure: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        """See io.FileIO; raises nothing."""
        if self.failure is None:
            try:
                return super().write(data)
            except OSError as error:
                self.failure = error
        return memoryview(data).nbytes


def open_missing() -> None:
    """Opens the null device for each of standard output and error that is closed, in whose place the next file that is
    opened would be, and get what is printed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.open(os.devnull, os.O_WRONLY), "w", closefd=False))


def tell(line: str) -> None:
    """Prints it on standard error, unless nobody is there any more, such as a terminal that was closed."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


def patient_stdout() -> _Patient:
    """Has standard output raise no errors any more; returns what keeps the first."""
    sys.stdout.flush()
    patient = _Patient(sys.stdout.fileno(), "w", closefd=False)
    sys.stdout = io.TextIOWrapper(io.BufferedWriter(patient), sys.stdout.encoding, sys.stdout.errors,
                                  line_buffering=sys.stdout.isatty())
    return patient


def stdout_problem(patient: _Patient) -> str:
    """What is to be told of it: empty where all was written, or whoever read it has gone."""
    sys.stdout.flush()
    failure = patient.failure
    if failure is None or failure.errno == errno.EPIPE:
        return ""
    return f"standard output cannot be written ({failure.strerror}); free some space there or redirect it elsewhere"
