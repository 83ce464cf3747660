"""The workers as the client knows them, their tasks and the source of tasks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

#: Weight of the latest measured speed in the expected one.
NEWS = 0.5


class BadResult(Exception):
    """An implausible result of a worker."""


@dataclass(eq=False)
class WorkerState:
    """A worker of the cluster, with its state and speed.

    facts: its answer to the introduction, None until it is ready. refused: why it is excluded; silent: whether another
    worker had to repeat its task and it has not answered since.
    rate: units of work per second, 0 if unknown; load, work: number of queued tasks, and their work; done: the work
    that it did.
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
        """Return whether it can be given tasks."""
        return self.facts is not None and not (self.refused or self.silent or self.gone)

    def ran(self, work: float, seconds: float) -> None:
        """Update the rate from the time that some work took."""
        rate = work / max(seconds, 1e-6)
        self.rate = rate if not self.rate else (1 - NEWS) * self.rate + NEWS * rate
        self.done += round(work)


@dataclass(eq=False)
class Task:
    """A task for one worker.

    what: the source's own data; name: for messages; work: in the source's units; arguments: created when it is sent;
    deaths: how many workers ended while they ran it; failures: how often it failed otherwise.
    """

    what: Any
    name: str
    work: float
    function: Callable[..., Any]
    arguments: Callable[[], tuple[Any, ...]]
    runs: list[RunningTask] = field(default_factory=list)
    deaths: int = 0
    failures: int = 0


@dataclass(eq=False)
class RunningTask:
    """A task on a worker. key: that it was sent under; ahead: the worker's queued work then, including this task."""

    key: str
    task: Task
    member: WorkerState
    began: float
    ahead: float


class TaskSource(Protocol):
    """Where tasks come from, and where their results go."""

    def left(self) -> bool:
        """Return whether there are, or may still be, tasks to dispatch."""

    def ahead(self, members: int) -> int:
        """Return how many tasks each of `members` workers should have queued."""

    def introduction(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the first call for a worker, whose result becomes its `facts`."""

    def meet(self, member: WorkerState) -> None:
        """Accept a worker that is ready. Raises BadResult if it must not be used."""

    def next(self, member: WorkerState) -> Task | None:
        """Return a task for this worker, or None for now."""

    def accept(self, task: Task, result: Any, member: WorkerState) -> None:
        """Accept a result. Raises BadResult if it is implausible."""
