"""Atomic file writing: a reader sees the old file or the new one, never a part of it."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import KeptBesideError, OutputError
from ..file_mode import keep_mode
from ..file_names import utf8_path

#: Seconds to pause after each failed attempt to replace a file that another program has open.
PAUSES = (0.05, 0.1, 0.2, 0.4, 0.8)


def check_target(path: Path) -> None:
    """Raise OutputError unless a file can be written at `path`; to be called before the work that produces it."""
    if path.is_dir():
        raise OutputError(f"{path}: is a folder; choose a file in it")
    _check_kind(path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist; create it first")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise OutputError(
            f"{path}: no file can be written in the folder {path.parent} ({error.strerror}); "
            "change its permissions or choose another folder"
        ) from error


def make_folder(path: Path) -> None:
    """Create a folder and its parents, unless they exist; raises OutputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: cannot be created ({error.strerror}); choose another path") from error


def _check_kind(path: Path) -> None:
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: is a device, a pipe or a socket, which is not replaced; choose a regular file")


def check_unprotected(path: Path, force: bool) -> None:
    """Raise OutputError if `path` is a read-only file, unless `force`; its mode decides, also for root."""
    if not force and path.is_file() and not path.stat().st_mode & 0o222:
        raise OutputError(f"{path}: is read-only; choose another file, make it writable, or replace it with --force")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Provide a temporary path next to `path`, with its extension; then atomically rename the file there to `path`.

    If the block fails, `path` is unchanged and no temporary file is left; an OSError is raised as OutputError. The file
    keeps the mode of the one that it replaces, and its owner and group if the user may set them. A symbolic link is
    kept: the file it points to is replaced. Raises OutputError if `path` is not a regular file. If the old file cannot
    be replaced, the new one stays next to it, and the OutputError names it.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".clrt-{os.urandom(8).hex()}{path.suffix.lower()}")
    try:
        with utf8_path(target.parent) as folder:
            yield folder / temporary.name
        _check_kind(target)
        keep_mode(target, temporary)
        _move(temporary, target)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error}); free some space there or choose another path"
        ) from error
    finally:
        with suppress(OSError):  # it was moved, or its folder is gone or read-only by now
            temporary.unlink()


def _move(new: Path, target: Path) -> None:
    """Rename a file over another, retrying: Windows refuses while a program, such as a viewer or, briefly, a virus
    scanner, has that open."""
    for pause in PAUSES:
        try:
            os.replace(new, target)
            return
        except PermissionError as error:
            problem = error
            time.sleep(pause)
    kept = target.with_name(f"{target.stem}-{os.urandom(4).hex()}{target.suffix}")
    os.replace(new, kept)
    raise KeptBesideError(
        f"{target}: cannot be replaced ({problem.strerror}); is it open in another program, or "
        f"read-only? The new file is {kept.name} next to it"
    ) from problem
