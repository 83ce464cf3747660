"""Manifest of finished images: a file with a line appended per image, so that an interrupted render can be resumed.

The first line identifies the render, each other one names an image and the SHA-256 of what was stored of it. An
incomplete line, the last one of a process that was killed, is ignored.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from ..errors import CheckpointError, OutputError
from ..rendering.checkpoint.checkpoint_file import check_replaceable
from ..rendering.checkpoint.identity import differences

VERSION = "clrt manifest 1"


class Manifest:
    """The finished images by name, with data on each. facts: of the render, see `identity.facts_of`.

    Raises CheckpointError if the file is of another render or no manifest, and OutputError if it cannot be written.
    """

    def __init__(self, path: Path, facts: dict[str, str], resume: bool) -> None:
        self.path = path
        self.done: dict[str, dict[str, Any]] = {}
        if not resume:
            check_replaceable(path, b'{"manifest": "clrt ')
        whole = self._read(facts) if resume and path.exists() else 0
        try:
            self._file = open(path, "r+b" if whole else "wb")
            self._file.truncate(whole)
            self._file.seek(whole)
            if not whole:
                self._write({"manifest": VERSION, "facts": facts})
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror})") from error

    def add(self, name: str, about: dict[str, Any]) -> None:
        """Record that an image is done; on disk when this returns."""
        self._write({"name": name, "about": about})
        self.done[name] = about

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, entry: dict[str, Any]) -> None:
        try:
            self._file.write(json.dumps(entry).encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written ({error.strerror})") from error

    def _read(self, facts: dict[str, str]) -> int:
        """Read the complete lines, and return their size in bytes."""
        content = self.path.read_bytes()
        lines = content[: content.rfind(b"\n") + 1].splitlines(keepends=True)
        try:
            first, *entries = [json.loads(line) for line in lines]
            found = first["facts"] if first["manifest"] == VERSION else None
            self.done = {str(entry["name"]): dict(entry["about"]) for entry in entries}
        except (ValueError, TypeError, LookupError):
            found = None
        if not isinstance(found, dict):
            raise CheckpointError(
                f"{self.path}: is not a list of images that this version of clrt can read; choose "
                "another file, or leave out --resume to start afresh"
            )
        if others := differences(found, facts):
            raise CheckpointError(
                f"{self.path}: is of another render ({', '.join(others)}); use its settings to "
                "resume it, choose another file, or leave out --resume to start afresh"
            )
        return sum(map(len, lines))
