"""A process that watches the one that renders, ends it where its driver hangs, and tells where a driver crashed.

A driver that hangs in a call may hold Python's lock, so that no thread of the same process would ever get to tell. The
process that renders is a fork of this one, made before anything large is loaded, and so costs some milliseconds. It is
a group of its own: all signals come here, and are handed on once.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from math import isinf

from ..device.pulse import VARIABLE, call_in_progress, patience
from .interrupt import end_by_signals

#: By their names, as Windows has few of them, and imports this, too.
CRASHES = {"SIGSEGV", "SIGABRT", "SIGBUS", "SIGFPE", "SIGILL"}
HANDED_ON = {"SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP"}
#: Of a patience, how often it is looked.
LOOKS = 20
DEVICE = 4
PR_SET_PDEATHSIG = 1


def guarded(advice: Callable[[], str]) -> None:
    """Returns in a new process, which is to do the work; this one exits as that one does, or with 4 where it hangs or
    crashes, and then with the advice. Where there is no such thing as a fork, or nothing to watch, it just returns."""
    limit = patience()
    if isinf(limit) or not hasattr(signal, "sigtimedwait"):
        return
    # What was started with nohup stays deaf to SIGHUP.
    handed_on = map(signal.Signals.__getitem__, HANDED_ON)
    watched = {each for each in handed_on if signal.getsignal(each) is not signal.SIG_IGN} | {signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, watched)
    parent = os.getpid()
    child = os.fork()
    if child:
        os._exit(_watch(child, watched, limit, advice))
    os.setpgid(0, 0)
    _die_with(parent)
    end_by_signals()    # before any can come: there is more to load until it is known what to keep
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _die_with(parent: int) -> None:
    """Has this process killed when its parent is; Linux alone can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
    if os.getppid() != parent:
        os._exit(1)


def _watch(child: int, watched: set[signal.Signals], limit: float, advice: Callable[[], str]) -> int:
    """The exit code, once the child has ended or was ended. Ticks are counted, not time: it may be stopped itself, and
    while the child is stopped there are none."""
    waited, last_call, stopped = 0, 0, False
    while True:
        came = signal.sigtimedwait(watched, limit / LOOKS)
        if came is not None and came.si_signo not in watched:   # what Python returns after a stop longer than the wait
            came = None
        changed, status = os.waitpid(child, os.WNOHANG | os.WUNTRACED | os.WCONTINUED)
        if changed and (os.WIFEXITED(status) or os.WIFSIGNALED(status)):
            return _exit_code(status, advice)
        stopped = os.WIFSTOPPED(status) if changed else stopped
        call = call_in_progress()
        waited = waited + (came is None and not stopped) if call and call == last_call else 0
        last_call = call
        if waited > LOOKS:
            os.kill(child, signal.SIGKILL)
            _say(f"the driver has not returned from a call in {limit:g} s: it hangs, or its device is lost; if calls "
                 f"may take that long there, set {VARIABLE} to more", advice)
            return DEVICE
        if came is not None and came.si_signo == signal.SIGTSTP:
            os.kill(child, signal.SIGSTOP)
            os.kill(os.getpid(), signal.SIGSTOP)
            os.kill(child, signal.SIGCONT)
        elif came is not None and came.si_signo != signal.SIGCHLD:
            os.kill(child, came.si_signo)


def _exit_code(status: int, advice: Callable[[], str]) -> int:
    if os.WIFEXITED(status):
        return os.WEXITSTATUS(status)
    name = signal.Signals(os.WTERMSIG(status)).name
    if name in CRASHES:
        from ..device.pocl_cache import kept_programs, remove_damaged

        damaged = remove_damaged()
        cause = (f"since PoCL keeps programs in {kept_programs()}, of which {damaged} were damaged: they are removed, "
                 "so run it again" if damaged else "most likely in the device's driver: see `clrt devices --check`")
        _say(f"the render crashed ({name}), {cause}", advice)
        return DEVICE
    known = "; by SIGKILL systems end what uses too much memory" if name == "SIGKILL" else ""
    _say(f"the render was ended from outside ({name}){known}", advice)
    return 128 + os.WTERMSIG(status)


def _say(problem: str, advice: Callable[[], str]) -> None:
    start = "\n" if sys.stderr.isatty() else ""     # there may be a line of progress
    print(f"{start}error: {problem}{advice()}", file=sys.stderr, flush=True)
