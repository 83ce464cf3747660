"""`clrt render -o -`: images to standard output, a pipe or a character device. They are encoded in a temporary file
first, as encoders seek."""

from __future__ import annotations

import errno
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from ..errors import OutputError, ReaderGoneError, UsageError

STDOUT = Path("-")
#: Names of standard output, even if it is redirected to a file.
ITS_NAMES = (STDOUT, Path("/dev/stdout"), Path("/dev/fd/1"), Path("/proc/self/fd/1"))
#: Formats that may precede the path, as in "exr:-".
FORMATS = ("png", "jpg", "webp", "tif", "exr", "hdr")


@dataclass(frozen=True)
class Pipe:
    """A pipe or device. path: the destination, STDOUT for standard output by any name; suffix: such as ".png"."""

    path: Path
    suffix: str

    def check(self) -> None:
        """Raise UsageError if it is a terminal or closed, OutputError if the format is unknown."""
        if self.suffix[1:] not in FORMATS:
            raise OutputError(
                f"{self.path}: unknown image format {self.suffix}; write FORMAT:{self.path}, with "
                f"{', '.join(FORMATS[:-1])} or {FORMATS[-1]}"
            )
        if self.path == STDOUT and sys.__stdout__ is None:
            raise UsageError("-o -: standard output is closed; redirect it to a file or a program")
        if self._is_terminal():
            raise UsageError(f"-o {self.path}: is a terminal; redirect it to a file or a program, or give a file name")

    def write(self, save: Callable[[Path], object]) -> None:
        """Write the image that `save` writes to a path; raises OutputError."""
        try:
            with tempfile.TemporaryDirectory(prefix="clrt-") as folder:
                file = Path(folder) / f"image{self.suffix}"
                save(file)
                with file.open("rb") as encoded, self._open() as pipe:
                    shutil.copyfileobj(encoded, pipe)
        except OSError as error:
            kind = ReaderGoneError if error.errno == errno.EPIPE else OutputError
            raise kind(f"{self.path}: cannot be written ({error.strerror or error})") from error

    def _open(self) -> IO[bytes]:
        return open(sys.stdout.fileno(), "wb", closefd=False) if self.path == STDOUT else self.path.open("wb")

    def _is_terminal(self) -> bool:
        if self.path == STDOUT:
            return sys.stdout.isatty()
        if not self.path.is_char_device():
            return False
        try:
            handle = os.open(self.path, os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written ({error.strerror})") from error
        try:
            return os.isatty(handle)
        finally:
            os.close(handle)


def split_pipes(outputs: Iterable[Path]) -> tuple[tuple[Path, ...], tuple[Pipe, ...]]:
    """Split the paths of -o into files and pipes. Raises UsageError if a pipe is named twice."""
    files, pipes = list[Path](), list[Pipe]()
    for path in outputs:
        if (pipe := pipe_at(path)) is None:
            files.append(path)
        elif pipe.path in {each.path for each in pipes}:
            raise UsageError(f"-o {pipe.path}: is given twice, but takes one image; give it once")
        else:
            pipes.append(pipe)
    return tuple(files), tuple(pipes)


def pipe_at(path: Path) -> Pipe | None:
    """Return the pipe at a path, "FORMAT:PATH" or "PATH"; None if it is not a pipe. The format defaults to the
    extension's, and to PNG without one."""
    kind, colon, name = str(path).partition(":")
    if colon and kind.isalnum() and _is_pipe(Path(name)):
        return Pipe(_known(Path(name)), f".{kind.lower()}")
    return Pipe(_known(path), path.suffix.lower() or ".png") if _is_pipe(path) else None


def _known(path: Path) -> Path:
    return STDOUT if path in ITS_NAMES else path


def _is_pipe(path: Path) -> bool:
    return path in ITS_NAMES or path.is_fifo() or path.is_char_device()
