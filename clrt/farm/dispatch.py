"""Dispatch tasks to the workers of a cluster until none is left, while workers may come, go, fail or sleep.

Each worker has its next task queued before it has ended one. Tasks of a dead worker are given to others, and so are,
once nothing else is left, overdue tasks of a slow one: the first result counts, and no other. A task that kills several
workers, or fails on several, is given up, and with it the render.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import CancelledError
from uuid import uuid4

from ..awake import watched_clock
from ..errors import ClrtError, DeviceError, HungError, SceneError
from .cluster import Cluster, Result
from .worker_states import BadResult, RunningTask, Task, TaskSource, WorkerState

#: Minimum seconds between two queries of the workers, also as a multiple of a query's duration; and the wait for
#: results.
LOOK, LOOK_COST, TICK = 0.5, 50, 0.1
#: A task is given up after this many deaths of workers, or failures.
MOST_DEATHS, MOST_FAILURES = 4, 3
#: A run is overdue after SLOW times its expected time plus SLACK seconds.
SLOW, SLACK = 2.0, 0.5
#: Seconds without a ready worker before a warning, and before giving up; and without a scheduler.
LONELY, HOPELESS, GONE = 20.0, 600.0, 120.0
#: Errors that mean a result was lost with its worker or the scheduler.
LOST = (CancelledError, TimeoutError, ConnectionError)
_log = logging.getLogger(__name__)


class Dispatch:
    """The workers of a cluster, and their tasks from one source. Raises DeviceError if no usable worker is left."""

    def __init__(self, cluster: Cluster, source: TaskSource) -> None:
        self.cluster, self._source = cluster, source
        self.members: dict[str, WorkerState] = {}
        self.former: list[WorkerState] = []
        self.tasks: list[Task] = []
        self._again: deque[Task] = deque()
        self._runs: dict[str, RunningTask] = {}
        self._meeting: dict[str, WorkerState] = {}
        self._next_look = self._alone_since = 0.0
        self._told_alone = False
        #: Number of tasks sent.
        self.sent = 0

    def run(self) -> Iterator[None]:
        """Run until the source has nothing left, keeping further tasks queued on workers; yield at least every TICK."""
        self._hand_out()
        while self._source.left():
            if not self.cluster.alive:
                yield from self._find_scheduler()
            self.meet()
            self._hand_out()
            yield

    def drain(self, tasks: list[Task], seconds: float) -> list[Task]:
        """Wait for these tasks, at most `seconds`; cancel and return those that were not done by then."""
        end = time.perf_counter() + seconds
        while any(task.runs for task in tasks) and self.cluster.alive and time.perf_counter() < end:
            for key, result in self.cluster.hear(TICK):
                self._hear(key, result)
        late = [task for task in tasks if task in self.tasks]
        self.forget(late)
        return late

    def forget(self, tasks: list[Task]) -> None:
        """Ignore the results of these tasks."""
        for task in tasks:
            task.runs.clear()
            self.tasks.remove(task)
            if task in self._again:
                self._again.remove(task)

    def wait_for(self, count: int = 1) -> list[WorkerState]:
        """Wait until `count` workers are ready, and return all that are."""
        while True:
            if len(ready := self.ready()) >= count:
                return ready
            if not self.cluster.alive:
                for _ in self._find_scheduler():
                    pass
            self.meet()

    def meet(self) -> None:
        """Introduce new workers, and process results."""
        self._look()
        for key, result in self.cluster.hear(TICK):
            self._hear(key, result)

    def everyone(self) -> list[WorkerState]:
        """Return all workers, including those that were lost."""
        return [*self.members.values(), *self.former]

    def ready(self) -> list[WorkerState]:
        """Return the workers that can be given tasks, least loaded first."""
        return sorted((member for member in self.members.values() if member.ready), key=lambda each: each.load)

    def _look(self) -> None:
        """Introduce new workers, and reassign the tasks of those that were lost."""
        now = time.perf_counter()
        if now < self._next_look:
            return
        there = self.cluster.workers()
        self._next_look = now + max(LOOK, LOOK_COST * (time.perf_counter() - now))
        for address in self.members.keys() - there.keys():
            self._part_with(self.members.pop(address))
        for address in there.keys() - self.members.keys():
            member = self.members[address] = WorkerState(address, there[address])
            function, arguments = self._source.introduction()
            key = f"clrt-meet-{uuid4().hex}"
            self._meeting[key] = member
            self.cluster.send(address, key, function, *arguments)
        self._check_alone(now)

    def _check_alone(self, now: float) -> None:
        """Warn if there is no ready worker, and give up if that is permanent."""
        hopes = [member for member in self.members.values() if not member.refused]
        if any(member.facts for member in hopes):
            self._alone_since = 0.0
        elif not hopes and (refused := list(dict.fromkeys(each.refused for each in self.everyone() if each.refused))):
            raise DeviceError(f"no worker of {self.cluster.address} is usable: {'; '.join(refused)}")
        elif not self._alone_since:
            self._alone_since = now
        elif now - self._alone_since > HOPELESS:
            raise DeviceError(
                f"no worker of {self.cluster.address} has answered for {HOPELESS:g} s; start some with "
                f"`dask worker {self.cluster.address}` where the same clrt is installed"
            )
        elif now - self._alone_since > LONELY and not self._told_alone:
            self._told_alone = True
            _log.warning(
                "%s has %s; waiting", self.cluster.address, "workers, none of which is ready" if hopes else "no worker"
            )

    def _part_with(self, member: WorkerState) -> None:
        """Remove a lost worker; the task that it was running may be the cause."""
        member.gone = True
        self.former.append(member)
        self._meeting = {key: other for key, other in self._meeting.items() if other is not member}
        runs = [run for run in self._runs.values() if run.member is member and run in run.task.runs]
        for place, run in enumerate(runs):
            run.task.runs.remove(run)
            run.task.deaths += place == 0
            if run.task.deaths >= MOST_DEATHS:
                raise DeviceError(
                    f"{run.task.name} has killed {run.task.deaths} workers, last {member.name}"
                    f"{self.cluster.last_words()}; see their logs, and run `clrt devices "
                    "--check` there"
                )
            self._repeat(run.task)
        for key in [key for key, run in self._runs.items() if run.member is member]:
            del self._runs[key]
            self.cluster.forget(key)
        if runs:
            _log.warning("%s is lost; other workers repeat its tasks", member.name)

    def _hand_out(self) -> None:
        """Queue tasks on the workers round-robin; then give overdue tasks to those without any."""
        ready = self.ready()
        for member in (each for load in range(self._source.ahead(len(ready))) for each in ready if each.load == load):
            task = self._again.popleft() if self._again else self._source.next(member)
            if task is None:
                break
            if task not in self.tasks:
                self.tasks.append(task)
            self._begin(task, member)
        idle = [member for member in ready if not member.load]
        for member, run in zip(idle, self._overdue() if idle else []):
            _log.info("%s is slow; %s repeats its task", run.member.name, member.name)
            self.cluster.is_late(run.key)
            self._begin(run.task, member)

    def _overdue(self) -> list[RunningTask]:
        """Return the overdue runs of tasks that no other worker runs, the oldest first."""
        rates = [member.rate for member in self.everyone() if member.rate]
        if not rates:
            return []
        usual, now = sum(rates) / len(rates), time.perf_counter()
        alone = [task.runs[0] for task in self.tasks if len(task.runs) == 1]
        return sorted(
            (run for run in alone if now - run.began > SLOW * run.ahead / (run.member.rate or usual) + SLACK),
            key=lambda run: run.began,
        )

    def _begin(self, task: Task, member: WorkerState) -> None:
        key = f"clrt-{uuid4().hex}"
        self.cluster.send(member.address, key, task.function, *task.arguments())
        self.sent += 1
        member.load += 1
        member.work += task.work
        run = RunningTask(key, task, member, time.perf_counter(), member.work)
        task.runs.append(run)
        self._runs[key] = run

    def _repeat(self, task: Task) -> None:
        """Queue the task again, unless another worker runs it."""
        if not task.runs and task in self.tasks and task not in self._again:
            self._again.append(task)

    def _hear(self, key: str, result: Result) -> None:
        """Process the outcome of an introduction or a run."""
        if key in self._meeting:
            self._met(self._meeting.pop(key), result)
        elif key in self._runs:
            self._ended(self._runs.pop(key), result)

    def _met(self, member: WorkerState, result: Result) -> None:
        try:
            member.facts = result.result().result()
            self._source.meet(member)
        except LOST:
            self.members.pop(member.address, None)  # to be introduced again if it is still there
        except SceneError:
            raise
        except Exception as error:  # any error is the worker's
            self._refuse(member, error)

    def _refuse(self, member: WorkerState, error: Exception) -> None:
        known = isinstance(error, ClrtError | BadResult | RuntimeError)
        told = str(error) if known else f"{type(error).__name__}: {error}"
        if not member.refused:
            _log.warning("%s is excluded: %s", member.name, told)
        member.refused = f"{member.name}: {told}"

    def _ended(self, run: RunningTask, result: Result) -> None:
        task, member = run.task, run.member
        member.load -= 1
        member.work -= task.work
        member.silent = False
        if run not in task.runs:
            return  # another worker was faster, or the task was cancelled
        task.runs.remove(run)
        try:
            found, seconds = result.result().result()
            self._source.accept(task, found, member)
        except LOST:
            self._repeat(task)
        except SceneError:
            raise
        except Exception as error:
            self._failed(task, member, error)
        else:
            member.ran(task.work, seconds)
            for other in task.runs:
                other.member.silent = True
            task.runs.clear()
            self.tasks.remove(task)

    def _failed(self, task: Task, member: WorkerState, error: Exception) -> None:
        """Exclude a worker that failed, and give its task to others, as the worker may be the cause."""
        if isinstance(error, LookupError):
            self.meet_again(member)
        else:
            task.failures += 1
            self._refuse(member, error)
        if task.failures >= MOST_FAILURES and not isinstance(error, HungError):
            raise DeviceError(f"{task.name} has failed on {task.failures} workers: {error}") from error
        self._repeat(task)

    def meet_again(self, member: WorkerState) -> None:
        """Introduce a worker again that has a new process at its address, or has forgotten the scene.

        All its queued tasks will fail in the same way.
        """
        if self.members.get(member.address) is member:
            self.former.append(self.members.pop(member.address))

    def _find_scheduler(self) -> Iterator[None]:
        """Wait until the scheduler answers again. Results so far are kept, and tasks in flight are repeated."""
        _log.warning("%s no longer answers; waiting up to %g s", self.cluster.address, GONE)
        self.former += self.members.values()
        self.members, self._runs, self._meeting = {}, {}, {}
        for task in self.tasks:
            task.runs.clear()
            self._repeat(task)
        with watched_clock() as clock:
            while not self.cluster.reconnect():
                if clock.seconds > GONE:
                    raise DeviceError(f"the scheduler at {self.cluster.address} has not answered for {GONE:g} s")
                yield
        _log.warning("%s answers again", self.cluster.address)
        self._next_look = 0.0
