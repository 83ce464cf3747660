"""The workers as the client knows them, what they are at, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

#: What of the latest speed goes into what is expected of the next.
NEWS = 0.5


class BadResult(Exception):
    """A worker gave something that cannot be right."""


@dataclass(eq=False)
class Member:
    """A worker. facts: what it said of itself; None until it is ready. refused: why it gets nothing any more; silent:
    whether others had to do its work again, and it has not been heard of since.

    rate: units of work a second, 0 as long as that is not known; load, work: tasks that it has at hand, and their work;
    done: the work that it did.
    """

    address: str
    name: str
    facts: dict[str, Any] | None = None
    refused: str = ""
    silent: bool = False
    gone: bool = False
    rate: float = 0.0
    load: int = 0
    work: float = 0.0
    done: int = 0

    @property
    def ready(self) -> bool:
        """Whether it may be given work."""
        return self.facts is not None and not (self.refused or self.silent or self.gone)

    def ran(self, work: float, seconds: float) -> None:
        """Takes into account how long some work took."""
        rate = work / max(seconds, 1e-6)
        self.rate = rate if not self.rate else (1 - NEWS) * self.rate + NEWS * rate
        self.done += round(work)


@dataclass(eq=False)
class Task:
    """Something to be done by one worker. what: as its source knows it; name: as messages call it; work: in the
    source's units; arguments: made as it is sent; deaths: how many workers ended while they were at it; failures: how
    often it failed otherwise."""

    what: Any
    name: str
    work: float
    function: Callable[..., Any]
    arguments: Callable[[], tuple[Any, ...]]
    runs: list[Run] = field(default_factory=list)
    deaths: int = 0
    failures: int = 0


@dataclass(eq=False)
class Run:
    """A task on a worker. key: that it was sent under; ahead: the work that it then had at hand, this one included."""

    key: str
    task: Task
    member: Member
    began: float
    ahead: float


class Source(Protocol):
    """Where tasks come from, and where their results go."""

    def left(self) -> bool:
        """Whether there is, or may still be, something to hand out."""

    def ahead(self, members: int) -> int:
        """How many tasks each of so many workers should have at hand."""

    def introduction(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """What a worker must do first, whose result becomes its `facts`."""

    def meet(self, member: Member) -> None:
        """Hears of one that is ready; BadResult where it must not be used."""

    def next(self, member: Member) -> Task | None:
        """Something for this worker, or None for now."""

    def accept(self, task: Task, result: Any, member: Member) -> None:
        """Takes a result; BadResult where that cannot be right."""
