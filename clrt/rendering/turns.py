"""Threads that share a renderer take turns: a step of one never runs beside a step of another."""

from __future__ import annotations

from collections.abc import Iterator
from threading import RLock
from typing import TypeVar

T = TypeVar("T")


def in_turns(turn: RLock, steps: Iterator[T]) -> Iterator[T]:
    """The steps, each of which waits for its turn and gives it up at its end."""
    while True:
        with turn:
            try:
                step = next(steps)
            except StopIteration:
                return
        yield step
