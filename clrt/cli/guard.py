"""Watchdog process for the rendering process: kills it if its driver hangs, and reports if a driver crashed.

A driver that hangs in a call may hold Python's GIL, so that no thread of the same process could report it. The
rendering process is a fork of this one, made before anything large is loaded, which costs a few milliseconds. It has
a process group of its own: all signals arrive here, and are forwarded once.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from math import isinf

from ..device.launches.hang_watchdog import VARIABLE, call_in_progress, patience
from .interrupt import end_by_signals

#: By name, as Windows has few of them and imports this module, too.
CRASHES = {"SIGSEGV", "SIGABRT", "SIGBUS", "SIGFPE", "SIGILL"}
HANDED_ON = {"SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP"}
#: Number of polls within the time limit of a call.
LOOKS = 20
DEVICE = 4
PR_SET_PDEATHSIG = 1


def guarded(advice: Callable[[], str]) -> None:
    """Return in a child process that does the work; this process exits with the child's code, or prints the advice and
    exits with 4 if the child hangs or crashes. Just returns if the platform has no fork or there is no time limit."""
    limit = patience()
    if isinf(limit) or not hasattr(signal, "sigtimedwait"):
        return
    # SIGHUP stays ignored if started with nohup.
    handed_on = map(signal.Signals.__getitem__, HANDED_ON)
    watched = {each for each in handed_on if signal.getsignal(each) is not signal.SIG_IGN} | {signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, watched)
    parent = os.getpid()
    child = os.fork()
    if child:
        os._exit(_watch(child, watched, limit, advice))
    os.setpgid(0, 0)
    _die_with(parent)
    end_by_signals()  # before any can come: there is more to load until it is known what to keep
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _die_with(parent: int) -> None:
    """Have this process killed when its parent dies; supported on Linux only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
    if os.getppid() != parent:
        os._exit(1)


def _watch(child: int, watched: set[signal.Signals], limit: float, advice: Callable[[], str]) -> int:
    """Wait until the child ends or is killed, and return the exit code. Polls are counted instead of time: this process
    may be stopped itself, and polls do not count while the child is stopped."""
    waited, last_call, stopped = 0, 0, False
    while True:
        came = signal.sigtimedwait(watched, limit / LOOKS)
        if came is not None and came.si_signo not in watched:  # after a stop longer than the timeout
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
            _say(
                f"the driver has not returned from a call in {limit:g} s: it hangs, or its device is lost; if calls "
                f"may take that long, set {VARIABLE} to more seconds",
                advice,
            )
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
        from ..device.driver_caches import no_room
        from ..device.pocl.kernel_cache import kept_programs, remove_damaged

        damaged = remove_damaged()
        cause = "most likely in the device's driver: run `clrt devices --check`"
        if damaged:
            cause = (
                f"because {damaged} of the programs that PoCL caches in {kept_programs()} were damaged: they have "
                "been removed, run it again"
            )
        if full := no_room():
            cause = f"because {full}"
        _say(f"the render crashed ({name}), {cause}", advice)
        return DEVICE
    known = "; systems send SIGKILL to processes that use too much memory" if name == "SIGKILL" else ""
    _say(f"the render was killed ({name}){known}", advice)
    return 128 + os.WTERMSIG(status)


def _say(problem: str, advice: Callable[[], str]) -> None:
    start = "\n" if sys.stderr.isatty() else ""  # end a progress line
    print(f"{start}error: {problem}{advice()}", file=sys.stderr, flush=True)
