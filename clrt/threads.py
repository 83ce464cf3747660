"""Threads, and waiting for them, without a lock that an exception could leave held.

Those of `threading` and `concurrent.futures` are written in Python: an exception out of a signal's handler that comes
between two of their lines leaves a lock held, and all threads that need it hang. Here every step that changes something
is one call of a function written in C, and who waits looks again every BEAT: a wake-up that is lost delays by that.
"""

from __future__ import annotations

import atexit
import os
import sys
import time
from _thread import allocate_lock, get_ident, start_new_thread
from collections.abc import Callable, Iterable
from contextlib import suppress
from math import inf
from typing import TypeVar
from weakref import finalize, ref

T = TypeVar("T")
U = TypeVar("U")
#: Seconds between two looks, and those that a process at its end waits for threads, at most.
BEAT, LAST_WAIT = 0.1, 15.0
#: The threads that a process waits for at its end, as (process, thread).
_running: set[tuple[int, int]] = set()


class Bell:
    """Wakes up the one thread that waits for it."""

    def __init__(self) -> None:
        self._lock = allocate_lock()
        self._lock.acquire()

    def ring(self) -> None:
        """Ends the wait, or the next one."""
        with suppress(RuntimeError):    # it rang already
            self._lock.release()

    def wait(self, seconds: float) -> None:
        """Returns when it rings, or after so many seconds; raises nothing, as a queue would, that could hold frames."""
        self._lock.acquire(timeout=seconds)


class Condition:
    """Wakes up threads as something changes that they wait for."""

    def __init__(self) -> None:
        #: Of each thread that waits, as long as it does.
        self._waiters: set[ref[Bell]] = set()

    def notify(self) -> None:
        """Has all threads that wait look again."""
        for waiter in list(self._waiters):
            if (bell := waiter()) is not None:
                bell.ring()

    def wait_for(self, holds: Callable[[], bool], seconds: float | None = None) -> bool:
        """Returns true as soon as `holds` does, which is called without any lock, or false after so many seconds."""
        bell = Bell()
        self._waiters.add(ref(bell, self._waiters.discard))
        end = inf if seconds is None else time.monotonic() + seconds
        while not (held := holds()) and (left := end - time.monotonic()) > 0:
            bell.wait(min(BEAT, left))
        return held


class Event:
    """Something that happens once, and can be waited for."""

    def __init__(self) -> None:
        self._happened, self._changed = False, Condition()

    def is_set(self) -> bool:
        """Whether it has happened."""
        return self._happened

    def set(self) -> None:
        """It has happened."""
        self._happened = True
        self._changed.notify()

    def wait(self, seconds: float | None = None) -> bool:
        """Whether it has happened; waits for that, for at most so many seconds."""
        return self._changed.wait_for(self.is_set, seconds)


def beside(work: Callable[[], T], *, daemon: bool = False) -> Callable[[], T]:
    """Begins `work` in a thread of its own. What is returned waits for its end, and returns or raises what it did.

    At its end the process waits LAST_WAIT seconds at most for threads that are no daemons: one that comes back from a
    library while Python ends could abort it.
    """
    results, errors, ended = list[T](), list[BaseException](), Condition()

    def run() -> None:
        try:
            if not daemon:
                _running.add((os.getpid(), get_ident()))
            results.append(work())
        except BaseException as error:  # whatever it is, it belongs to who waits
            errors.append(error)
        finally:
            _running.discard((os.getpid(), get_ident()))
            ended.notify()

    def result() -> T:
        ended.wait_for(lambda: bool(results or errors) or sys.is_finalizing())
        if errors:
            raise errors[0]
        if not results:
            raise RuntimeError("Python has ended all other threads")
        return results[0]

    start_new_thread(run, ())
    return result


def in_parallel(work: Callable[[U], T], items: Iterable[U]) -> list[T]:
    """What `work` returns for each item, in order, from as many threads as there are cores, this one among them.

    Raises the exception of the first item that has one, once no thread works any more; none begins another item then.
    """
    todo = list(enumerate(items))
    left, results, errors = iter(todo), dict[int, T](), dict[int, BaseException]()

    def work_on() -> None:
        for number, item in left:
            try:
                results[number] = work(item)
            except BaseException as error:
                errors[number] = error
                list(left)

    try:
        others = [beside(work_on) for _ in range(min(os.cpu_count() or 1, len(todo)) - 1)]
        work_on()
        for result in others:
            result()
    finally:
        list(left)
    if errors:
        raise errors[min(errors)]
    return [results[number] for number in range(len(todo))]


# What threads hold, temporary folders among it, lives until they have ended: a process at its end calls functions in
# reverse order, and weakref registers its own with the first of its objects.
finalize(Condition, bool).detach()


@atexit.register
def _await_threads() -> None:
    end, process = time.monotonic() + LAST_WAIT, os.getpid()
    while any(each == process for each, _ in list(_running)) and time.monotonic() < end:
        time.sleep(1e-3)
