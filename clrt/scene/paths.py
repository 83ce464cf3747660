"""Files that scenes name: what is at a path, and which of them were read."""

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
    """Collects the files that this thread reads of scenes meanwhile."""
    files: list[Path] = []
    token = _read.set(files)
    try:
        yield files
    finally:
        _read.reset(token)


def note_read(path: Path) -> Path:
    """The path, of a file that is read now."""
    if (files := _read.get()) is not None:
        files.append(path)
    return path


def name_of(path: Path) -> str:
    """What a scene or mesh from a file at `path` is called: the file's stem, as text."""
    return printable(path.stem)


def check_file(path: Path, what: str) -> None:
    """Raise SceneError unless there is a regular file at `path`, to be read; what: "scene", "model" or "picture"."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder, not a {what}")
    if path.exists() and not path.is_file():
        raise SceneError(f"{path}: is a device, a pipe or a socket, not a {what}; name a regular file")
    if not path.exists():
        raise SceneError(f"{path}: no such {what} file")
    note_read(path)
