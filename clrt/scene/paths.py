"""What is at a path that names a file to read."""

from __future__ import annotations

from pathlib import Path

from ..errors import SceneError


def check_file(path: Path, what: str) -> None:
    """Raise SceneError unless there is a regular file at `path`; what: "scene", "model" or "picture"."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder, not a {what}")
    if path.exists() and not path.is_file():
        raise SceneError(f"{path}: is a device, a pipe or a socket, not a {what}; name a regular file")
    if not path.exists():
        raise SceneError(f"{path}: no such {what} file")
