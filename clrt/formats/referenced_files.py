"""Input files of scenes: checks of paths, and a record of the files that were read."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ..errors import SceneError
from ..file_names import printable

log = logging.getLogger(__name__)
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


def find_file(referrer: Path, folders: Iterable[Path], name: str) -> Path | None:
    """Return the file that the one at `referrer` refers to by `name`; None if there is none.

    It may be quoted and have backslashes. Looked for in each folder, by the whole path, then by the file's name alone,
    since paths are often those of another computer; then in each folder regardless of letter case, with a warning.
    """
    name = name.strip().strip('"').replace("\\", "/")
    base = name.rsplit("/", 1)[-1]
    if not base or "\0" in name:
        return None
    folders = list(dict.fromkeys(folders))
    candidates = [folder / each for each in dict.fromkeys((name, base)) for folder in folders]
    try:
        if found := next((file for file in candidates if file.is_file()), None):
            return found
        for file in candidates:
            if (found := _any_case(file)) is not None and found.is_file():
                log.warning("%s: no file %s; using %s", referrer, printable(name), printable(found.name))
                return found
    except OSError:  # such as a name that is too long
        pass
    return None


def _any_case(path: Path) -> Path | None:
    """Return the file or folder whose path differs in letter case only; the first of several."""
    folder = path.parent if path.parent.is_dir() else _any_case(path.parent)
    if folder is None or not folder.is_dir():
        return None
    return next((each for each in sorted(folder.iterdir()) if each.name.lower() == path.name.lower()), None)
