"""Checkpoints of a render: when they are written, and which of them it may be resumed from."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from ...errors import CheckpointError, OutputError, UsageError
from ...scene.model import Scene
from ...threads import beside
from ..compile.choices import Choices
from ..compile.film_record import film_features, film_groups
from .checkpoint_file import FAMILY, check_replaceable, older, read_checkpoint, write_checkpoint
from .identity import differences, facts_of
from .policy import CheckpointPolicy
from .saved_state import KINDS, NO_SENSE, SavedState, from_arrays, to_arrays

#: Minimum time between two checkpoints, as a multiple of the time that writing one takes.
COST = 50
_log = logging.getLogger(__name__)


class Checkpoints:
    """Checkpoints of one render, in two generations at one path (checkpoint_file.py).

    facts: see identity.facts_of; device: the rendering device; seconds: minimum interval, longer if writing is slow.
    """

    def __init__(self, path: Path, facts: dict[str, str], device: str, seconds: float) -> None:
        if not path.parent.is_dir() or path.exists() and not path.is_file():
            raise OutputError(f"{path}: cannot store a checkpoint; choose a regular file in an existing folder")
        if not seconds >= 0:
            raise UsageError(f"checkpoint_seconds is {seconds}; it must be 0 or more")
        self.path, self._facts, self._device, self._every = path, facts, device, seconds
        self._next = time.perf_counter() + seconds
        self._failed, self._newest_is_whole = False, True
        self._writing: Callable[[], None] = lambda: None

    def warn_of_another(self) -> None:
        """Warn that this render replaces an existing checkpoint. Raises CheckpointError if the file is something
        else."""
        check_replaceable(self.path, FAMILY)
        if self.path.exists():
            _log.warning("%s: this checkpoint will be replaced; to continue from it, use --resume", self.path)

    @property
    def due(self) -> bool:
        """Whether the next checkpoint is due."""
        return time.perf_counter() >= self._next

    def begin(self, kept: SavedState) -> None:
        """Start writing a checkpoint in the background; the state must not change until `wait` has returned."""
        self.wait()
        self._writing = beside(lambda: self.write(kept))

    def wait(self) -> None:
        """Wait for the write that `begin` started."""
        self._writing()

    def write(self, kept: SavedState) -> None:
        """Write a checkpoint; if that fails, warn once and keep the previous one."""
        start = time.perf_counter()
        header = {
            "facts": self._facts,
            "device": self._device,
            "planned_spp": kept.planned_spp,
            "seconds": kept.seconds,
        }
        try:
            write_checkpoint(self.path, header, to_arrays(kept), keep_older=self._newest_is_whole)
            self._failed, self._newest_is_whole = False, True
        except OSError as error:
            if not self._failed:
                _log.warning(
                    "%s: the checkpoint cannot be written (%s); the render continues and tries again later",
                    self.path,
                    error.strerror or error,
                )
            self._failed = True
        end = time.perf_counter()
        self._next = end + max(self._every, COST * (end - start))

    def read(self, size: tuple[int, int], features: Collection[str] = (), groups: int = 0) -> SavedState | None:
        """Return the newest intact state, of an image of (width, height) whose film stores what the features require
        and this many light groups, or None if there is no checkpoint yet.

        Raises CheckpointError if it belongs to another render, or if no generation is intact.
        """
        problems: list[str] = []
        for path in (self.path, older(self.path)):
            try:
                header, arrays = read_checkpoint(path, KINDS)
                self._check_facts(path, header)
                kept = from_arrays(header, arrays, size, features, groups)
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
            check_replaceable(self.path, FAMILY)  # else starting afresh would be refused, too
            raise CheckpointError(
                f"{'; '.join(problems)}; there is nothing to resume: leave out --resume to start afresh"
            )
        _log.warning("%s: does not exist yet, so the render starts afresh", self.path)
        return None

    def _check_facts(self, path: Path, header: dict[str, Any]) -> None:
        if not isinstance(found := header.get("facts"), dict):
            raise ValueError(NO_SENSE)
        if others := differences(found, self._facts):
            raise CheckpointError(
                f"{path}: is a checkpoint of another render ({', '.join(others)}); use its settings "
                "to resume it, choose another file, or leave out --resume to start afresh"
            )

    def _warn(self, path: Path, header: dict[str, Any], problems: list[str]) -> None:
        if problems:
            _log.warning("%s; resuming from the older %s", "; ".join(problems), path)
        if header.get("device") != self._device:
            _log.warning(
                "%s: was started on %s; samples from %s may be rounded differently",
                path,
                header.get("device"),
                self._device,
            )


def open_checkpoints(
    policy: CheckpointPolicy, scene: Scene, choices: Choices, device: str
) -> tuple[Checkpoints | None, SavedState | None]:
    """Return a render's checkpoints, if enabled, and the state to resume from, if there is one."""
    if policy.checkpoint is None:
        if policy.resume:
            raise UsageError("resume needs a checkpoint; give its file, too")
        return None, None
    checkpoints = Checkpoints(Path(policy.checkpoint), facts_of(scene, choices), device, policy.checkpoint_seconds)
    if policy.resume:
        return checkpoints, checkpoints.read(
            scene.render.size, film_features(scene, choices), len(film_groups(scene, choices))
        )
    checkpoints.warn_of_another()
    return checkpoints, None


def check_of_none(checkpoints: Checkpoints | None) -> None:
    """Raise UsageError if checkpoints are written, before another image is started."""
    if checkpoints is not None:
        raise UsageError("a checkpoint stores one image of one camera; create a renderer for each")
