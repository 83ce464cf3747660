"""Mutual exclusion of threads that share a renderer: steps of different threads never run concurrently."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import TypeVar

from ..float_errors import default_errors

T = TypeVar("T")


class ThreadTurns:
    """Reentrant lock of one renderer."""

    def __init__(self) -> None:
        self._lock = RLock()

    @contextmanager
    def one(self) -> Iterator[None]:
        """Context for one turn; waits for the lock."""
        with self._lock, default_errors():
            yield

    def of(self, steps: Iterator[T]) -> Iterator[T]:
        """Run each of the steps in a turn of its own, yielding their values between turns."""
        while True:
            with self._lock, default_errors():  # not `one`: an exception in contextlib could leave the lock held
                try:
                    step = next(steps)
                except StopIteration:
                    return
            yield step
