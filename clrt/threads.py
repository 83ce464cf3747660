"""Threads, events and conditions without a lock that an exception could leave held.

Those of `threading` and `concurrent.futures` are written in Python: if a signal handler raises an exception between
two of their lines, a lock may stay held, and all threads that need it hang. Here every state change is a single call of
a C function, and waiting threads poll every BEAT, so that a lost wake-up only causes that delay.
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
#: Polling interval in seconds, and the maximum time that an exiting process waits for threads.
BEAT, LAST_WAIT = 0.1, 15.0
#: Threads that an exiting process waits for, as (process, thread).
_running: set[tuple[int, int]] = set()


class Bell:
    """Wake-up signal for a single waiting thread."""

    def __init__(self) -> None:
        self._lock = allocate_lock()
        self._lock.acquire()

    def ring(self) -> None:
        """End the current wait, or the next one."""
        with suppress(RuntimeError):  # already rung
            self._lock.release()

    def wait(self, seconds: float) -> None:
        """Wait until it rings, or for this many seconds. Raises no exception that would keep frames alive."""
        self._lock.acquire(timeout=seconds)


class Condition:
    """Condition variable that wakes up all waiting threads."""

    def __init__(self) -> None:
        #: One per waiting thread, for as long as it waits.
        self._waiters: set[ref[Bell]] = set()

    def notify(self) -> None:
        """Make all waiting threads check their condition."""
        for waiter in list(self._waiters):
            if (bell := waiter()) is not None:
                bell.ring()

    def wait_for(self, holds: Callable[[], bool], seconds: float | None = None) -> bool:
        """Return True as soon as `holds` does, which is called without any lock, or False after this many seconds."""
        bell = Bell()
        self._waiters.add(ref(bell, self._waiters.discard))
        end = inf if seconds is None else time.monotonic() + seconds
        while not (held := holds()) and (left := end - time.monotonic()) > 0:
            bell.wait(min(BEAT, left))
        return held


class Event:
    """Event that is set once and can be waited for."""

    def __init__(self) -> None:
        self._happened, self._changed = False, Condition()

    def is_set(self) -> bool:
        """Return whether it is set."""
        return self._happened

    def set(self) -> None:
        """Set it, and wake up the waiting threads."""
        self._happened = True
        self._changed.notify()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it is set, or for this many seconds at most; return whether it is set."""
        return self._changed.wait_for(self.is_set, seconds)


def beside(work: Callable[[], T], *, daemon: bool = False) -> Callable[[], T]:
    """Start `work` in a new thread. The returned function waits for its end, and returns or raises what it did.

    At exit the process waits at most LAST_WAIT seconds for non-daemon threads: a thread that returns from a library
    call during interpreter shutdown could abort the process.
    """
    results, errors, ended = list[T](), list[BaseException](), Condition()

    def run() -> None:
        try:
            if not daemon:
                _running.add((os.getpid(), get_ident()))
            results.append(work())
        except BaseException as error:  # passed on to the thread that waits
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
    """Return what `work` returns for each item, in order, using as many threads as there are cores, including this one.

    After an exception no further items are started; that of the first such item is raised once all threads are done.
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


# Objects used by threads, such as temporary folders, must live until these have ended: exit functions are called in
# reverse order, and weakref registers its own with the first finalizer.
finalize(Condition, bool).detach()


@atexit.register
def _await_threads() -> None:
    end, process = time.monotonic() + LAST_WAIT, os.getpid()
    while any(each == process for each, _ in list(_running)) and time.monotonic() < end:
        time.sleep(1e-3)
