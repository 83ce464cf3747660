"""Threads that share a renderer take turns: a step of one never runs beside a step of another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import TypeVar

from ..float_errors import default_errors

T = TypeVar("T")


class Turns:
    """Those of one renderer. The thread whose turn it is may take another one in it."""

    def __init__(self) -> None:
        self._lock = RLock()

    @contextmanager
    def one(self) -> Iterator[None]:
        """A turn, for which this may wait."""
        with self._lock, default_errors():
            yield

    def of(self, steps: Iterator[T]) -> Iterator[T]:
        """The steps, a turn each."""
        while True:
            with self._lock, default_errors():  # not `one`: an exception in contextlib could leave the lock held
                try:
                    step = next(steps)
                except StopIteration:
                    return
            yield step
