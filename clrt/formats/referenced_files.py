"""Input files of scenes: checks of paths, and a record of the files that were read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ..errors import SceneError
from ..file_names import printable

_read: ContextVar[list[Path] | None] = ContextVar("_read", default=None)


@contextmanager
def files_read() -> Iterator[list[Path]]:
    """Collect the scene files that this thread reads inside the context."""
    files: list[Path] = []
    token = _read.set(files)
    try:
        yield files
    finally:
        _read.reset(token)


def note_read(path: Path) -> Path:
    """Record the file as read, and return its path."""
    if (files := _read.get()) is not None:
        files.append(path)
    return path


def name_of(path: Path) -> str:
    """Return the name of a scene or mesh from a file at `path`: the file's stem, as printable text."""
    return printable(path.stem)


def check_file(path: Path, what: str) -> None:
    """Raise SceneError unless `path` is a regular file, and note it as read; what: "scene", "model" or "picture"."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder, not a {what}")
    if path.exists() and not path.is_file():
        raise SceneError(f"{path}: is a device, a pipe or a socket, not a {what}; choose a regular file")
    if not path.exists():
        raise SceneError(f"{path}: no such {what} file")
    note_read(path)
