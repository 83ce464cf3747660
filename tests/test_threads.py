"""Waits between threads: results, exceptions, and that an exception at any line does not block other threads."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
from _thread import get_ident
from collections.abc import Callable

import numpy as np
import pytest

from clrt import threads
from clrt.threads import BEAT, Condition, Event, beside, in_parallel

from .interrupted import Interrupted, run

pytestmark = pytest.mark.processes

#: Timeout in seconds of anything that would otherwise never end.
LONG = 60.0


def everywhere(prepare: Callable[[], tuple[Callable[[], object], Callable[[], None]]]) -> None:
    """Interrupt a newly prepared call at each of its lines in turn, and check the state it left."""
    last = 1
    while True:
        call, check = prepare()
        if run(call, (threads.__file__,), last) < last:
            break
        check()
        last += 1
    assert last > 3


def test_an_event_interrupted_at_any_line_of_set_wakes_others() -> None:
    """Both current and later waiters return once the event is set again."""

    def prepare() -> tuple[Callable[[], object], Callable[[], None]]:
        event = Event()
        waits = [beside(lambda: event.wait(LONG)) for _ in range(3)]

        def check() -> None:
            event.set()
            start = time.monotonic()
            assert event.wait(LONG) and all(wait() for wait in waits)
            assert time.monotonic() - start < LONG / 2

        return event.set, check

    everywhere(prepare)


def test_a_wait_interrupted_at_any_line_leaves_the_others() -> None:
    def prepare() -> tuple[Callable[[], object], Callable[[], None]]:
        event = Event()
        other = beside(lambda: event.wait(LONG))

        def check() -> None:
            event.set()
            assert event.wait(LONG) and other()

        return lambda: event.wait(1e-3), check

    everywhere(prepare)


def test_a_lost_wake_up_costs_a_beat() -> None:
    """Without a notification, waiters notice the change themselves."""
    happened, changed = list[int](), Condition()
    wait = beside(lambda: changed.wait_for(lambda: bool(happened), LONG))
    time.sleep(BEAT)
    happened.append(1)
    start = time.monotonic()
    assert wait()
    assert time.monotonic() - start < LONG / 2


def test_whoever_no_longer_waits_is_forgotten() -> None:
    condition = Condition()
    for last in (1, 2, 3, 4, 5, 6):
        run(lambda: condition.wait_for(lambda: False, 1e-3), (threads.__file__,), last)
    assert not condition._waiters


def test_a_wait_ends_after_its_time() -> None:
    start = time.monotonic()
    assert not Event().wait(2.5 * BEAT)
    assert time.monotonic() - start >= 2.5 * BEAT


def test_an_exception_sent_to_a_thread_ends_its_wait() -> None:
    """Sent by PyThreadState_SetAsyncExc; other waiters continue to wait."""
    event, ident = Event(), list[int]()

    def wait() -> bool:
        ident.append(get_ident())
        return event.wait(LONG)

    other, wanted = beside(lambda: event.wait(LONG)), beside(wait)
    while not ident:
        time.sleep(1e-3)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(ident[0]), ctypes.py_object(Interrupted))
    with pytest.raises(Interrupted):
        wanted()
    event.set()
    assert other()


def test_beside_interrupted_at_any_line_ends() -> None:
    """The work is done at most once, and its result can be requested again."""

    def prepare() -> tuple[Callable[[], object], Callable[[], None]]:
        done, results = list[int](), list[Callable[[], None]]()

        def call() -> None:
            results.append(beside(lambda: done.append(1)))
            results[0]()

        def check() -> None:
            if results:
                results[0]()
                assert done == [1]

        return call, check

    everywhere(prepare)


def test_beside_returns_and_raises_what_its_work_did() -> None:
    assert beside(lambda: 7)() == 7
    failed = beside(lambda: 1 // 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            failed()


@pytest.mark.parametrize("count", [0, 1, 2, 1000])
def test_results_come_in_order(count: int) -> None:
    assert in_parallel(lambda number: number**2, range(count)) == [number**2 for number in range(count)]


def test_every_item_is_worked_on_once_by_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two items that wait for each other finish only if they run concurrently, for which one core is enough."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    events = Event(), Event()

    def meet(number: int) -> bool:
        events[number].set()
        return events[1 - number].wait(LONG)

    assert in_parallel(meet, (0, 1)) == [True, True]


def test_the_first_exception_is_raised_and_no_other_item_begun() -> None:
    """If several items fail at random, the first in order is raised, regardless of thread scheduling."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        bad, begun = set(rng.choice(200, 5, replace=False).tolist()), list[int]()

        def work(number: int) -> None:
            begun.append(number)
            if number in bad:
                raise ValueError(number)

        with pytest.raises(ValueError) as raised:
            in_parallel(work, range(200))
        assert raised.value.args == (min(bad),)
        before = len(begun)
        time.sleep(1e-3)
        assert len(begun) == before and len(set(begun)) == before


def test_in_parallel_interrupted_at_any_line_begins_no_other_item() -> None:
    def prepare() -> tuple[Callable[[], object], Callable[[], None]]:
        begun = list[int]()

        def work(number: int) -> None:
            begun.append(number)
            time.sleep(1e-3)

        def check() -> None:
            time.sleep(5e-3)
            before = len(begun)
            time.sleep(5e-3)
            assert len(begun) == before

        return lambda: in_parallel(work, range(8)), check

    everywhere(prepare)


@pytest.mark.parametrize("daemon", [False, True])
def test_a_process_waits_for_threads_that_are_no_daemons(daemon: bool) -> None:
    program = f"""
import time
from clrt.threads import beside
beside(lambda: (time.sleep(1), print("done", flush=True)), daemon={daemon})
time.sleep(0.3)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=LONG)
    assert (done.returncode, done.stdout, done.stderr) == (0, "" if daemon else "done\n", "")


def test_temporary_folders_outlive_the_threads_that_write_to_them() -> None:
    program = """
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from clrt.threads import beside
def work():
    with TemporaryDirectory() as folder:
        begun.append(True)
        for number in range(100):
            time.sleep(1e-3)
            Path(folder, str(number)).touch()
    print("done", flush=True)
begun = []
beside(work)
while not begun:
    time.sleep(1e-3)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=LONG)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


def test_a_process_that_is_taken_apart_waits_for_no_thread() -> None:
    """No thread can start during interpreter shutdown, so the result is a RuntimeError."""
    program = """
from clrt.threads import beside
class Last:
    def __del__(self, beside=beside):
        beside(lambda: 7)()
last = Last()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=LONG)
    assert done.returncode == 0 and "RuntimeError" in done.stderr
