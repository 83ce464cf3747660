"""Checkpoints of a render: when they are written, and which of them it may go on from."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import CheckpointError, OutputError, UsageError
from ..scene.model import Scene
from ..threads import beside
from .checkpoint_file import FAMILY, check_replaceable, older, read_checkpoint, write_checkpoint
from .choices import Choices
from .identity import differences, facts_of
from .kept import KINDS, NO_SENSE, Kept, from_arrays, to_arrays

#: Between two checkpoints passes at least this many times what writing one takes.
COST = 50
_log = logging.getLogger(__name__)


class Checkpoints:
    """The checkpoints of one render, in two generations at one path (checkpoint_file.py).

    facts: see identity.facts_of; device: who renders; seconds: between two checkpoints, or longer where they cost much.
    """

    def __init__(self, path: Path, facts: dict[str, str], device: str, seconds: float) -> None:
        if not path.parent.is_dir() or path.exists() and not path.is_file():
            raise OutputError(f"{path}: is no place for a checkpoint; name a regular file in a folder that exists")
        if not seconds >= 0:
            raise UsageError(f"checkpoint_seconds is {seconds}; it must be 0 or more")
        self.path, self._facts, self._device, self._every = path, facts, device, seconds
        self._next = time.perf_counter() + seconds
        self._failed, self._newest_is_whole = False, True
        self._writing: Callable[[], None] = lambda: None

    def warn_of_another(self) -> None:
        """Warns where there is one already, which this render will replace. CheckpointError where it is none."""
        check_replaceable(self.path, FAMILY)
        if self.path.exists():
            _log.warning("%s: this checkpoint will be replaced; --resume goes on from it", self.path)

    @property
    def due(self) -> bool:
        """Whether it is time for the next one."""
        return time.perf_counter() >= self._next

    def begin(self, kept: Kept) -> None:
        """Begins to write one, of which nothing may change until `wait` has returned."""
        self.wait()
        self._writing = beside(lambda: self.write(kept))

    def wait(self) -> None:
        """Returns when what `begin` began has ended."""
        self._writing()

    def write(self, kept: Kept) -> None:
        """Writes one; where that is not possible it warns, once, and what was written before stays."""
        start = time.perf_counter()
        header = {"facts": self._facts, "device": self._device, "planned_spp": kept.planned_spp,
                  "seconds": kept.seconds}
        try:
            write_checkpoint(self.path, header, to_arrays(kept), keep_older=self._newest_is_whole)
            self._failed, self._newest_is_whole = False, True
        except OSError as error:
            if not self._failed:
                _log.warning("%s: the checkpoint cannot be written (%s); the render goes on, and tries again later",
                             self.path, error.strerror or error)
            self._failed = True
        end = time.perf_counter()
        self._next = end + max(self._every, COST * (end - start))

    def read(self, size: tuple[int, int]) -> Kept | None:
        """The last whole one, of a picture of (width, height); None where there is none yet.

        CheckpointError where it is of another render, or none of the generations is whole.
        """
        problems: list[str] = []
        for path in (self.path, older(self.path)):
            try:
                header, arrays = read_checkpoint(path, KINDS)
                self._check_facts(path, header)
                kept = from_arrays(header, arrays, size)
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:
                reason = f"cannot be read ({error.strerror})" if isinstance(error, OSError) else error
                problems.append(f"{path} {reason}")
                self._newest_is_whole = self._newest_is_whole and path != self.path
                continue
            self._warn(path, header, problems)
            return kept
        if problems:
            check_replaceable(self.path, FAMILY)    # else to begin anew would be refused, too
            raise CheckpointError(f"{'; '.join(problems)}; there is nothing to go on from: leave out --resume to begin "
                                  "anew")
        _log.warning("%s: there is no checkpoint yet, so the render begins", self.path)
        return None

    def _check_facts(self, path: Path, header: dict[str, Any]) -> None:
        if not isinstance(found := header.get("facts"), dict):
            raise ValueError(NO_SENSE)
        if others := differences(found, self._facts):
            raise CheckpointError(f"{path}: is a checkpoint of another render ({', '.join(others)}); ask for that one "
                                  "to go on, name another file, or leave out --resume to begin anew")

    def _warn(self, path: Path, header: dict[str, Any], problems: list[str]) -> None:
        if problems:
            _log.warning("%s; going on from the older %s", "; ".join(problems), path)
        if header.get("device") != self._device:
            _log.warning("%s: was begun on %s, and what %s adds may be rounded otherwise", path, header.get("device"),
                         self._device)


def open_checkpoints(path: str | Path | None, resume: bool, seconds: float, scene: Scene, choices: Choices,
                     device: str) -> tuple[Checkpoints | None, Kept | None]:
    """A render's checkpoints, if it is to have any, and what it goes on from, if there is something."""
    if path is None:
        if resume:
            raise UsageError("resume goes on from a checkpoint, and none is named; name its file, too")
        return None, None
    checkpoints = Checkpoints(Path(path), facts_of(scene, choices), device, seconds)
    if resume:
        return checkpoints, checkpoints.read(scene.render.size)
    checkpoints.warn_of_another()
    return checkpoints, None


def check_of_none(checkpoints: Checkpoints | None) -> None:
    """UsageError where one is kept, before another picture is begun."""
    if checkpoints is not None:
        raise UsageError("a checkpoint is of one picture, seen by one camera; make a renderer for each")
