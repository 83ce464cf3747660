"""Write files so that a reader sees the old one or the new one, never half of one."""

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

#: Seconds after each attempt to replace a file that another program has open.
PAUSES = (0.05, 0.1, 0.2, 0.4, 0.8)


def check_target(path: Path) -> None:
    """Raise OutputError unless a file can be written at `path`; for use before the work that fills it."""
    if path.is_dir():
        raise OutputError(f"{path}: is a folder; name a file in it")
    _check_kind(path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist; create it first")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise OutputError(f"{path}: no file can be written in the folder {path.parent} ({error.strerror}); "
                          "change its permissions or choose another folder") from error


def make_folder(path: Path) -> None:
    """Makes a folder and those that it is in, unless they are there; raises OutputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: cannot be made ({error.strerror}); choose another path") from error


def _check_kind(path: Path) -> None:
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: is a device, a pipe or a socket, which is not replaced; name a regular file")


def check_unprotected(path: Path, force: bool) -> None:
    """Raise OutputError where there is a read-only file at `path`, unless `force`; its mode decides, also for root."""
    if not force and path.is_file() and not path.stat().st_mode & 0o222:
        raise OutputError(f"{path}: is read-only; name another file, make it writable, or replace it with --force")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lend a path beside `path`, with its extension, to write to; then move that file onto `path` in one step.

    If the block fails, `path` is as it was and nothing is left beside it; an OSError comes out as OutputError. The file
    keeps the mode of the one that it replaces, and its owner and group where the user may set them.
    A link stays a link: the file it points to is replaced. What is no regular file never is: OutputError.
    Where the old file cannot be replaced, the new one stays beside it, and the OutputError names it.
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
        raise OutputError(f"{path}: cannot be written ({error.strerror or error}); "
                          "free some space there or choose another path") from error
    finally:
        with suppress(OSError):     # it was moved, or its folder is gone or read-only by now
            temporary.unlink()


def _move(new: Path, target: Path) -> None:
    """Moves a file onto another, which Windows refuses while a program has that open: a viewer, or a virus scanner for
    a moment."""
    for pause in PAUSES:
        try:
            os.replace(new, target)
            return
        except PermissionError as error:
            problem = error
            time.sleep(pause)
    kept = target.with_name(f"{target.stem}-{os.urandom(4).hex()}{target.suffix}")
    os.replace(new, kept)
    raise KeptBesideError(f"{target}: cannot be replaced ({problem.strerror}); is it open in another program, or "
                          f"read-only? The new file is {kept.name} beside it") from problem
