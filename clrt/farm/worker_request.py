"""Request a result from one worker of a cluster, and from another one if that worker is lost meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from .dispatch import LOST, Dispatch

if TYPE_CHECKING:
    from distributed import Future

    from .worker_states import WorkerState


def ask(dispatch: Dispatch, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what the function returns, or raise what it raises, on a worker that is ready.

    A worker that has forgotten the scene is introduced again; results of tasks are still processed. Raises DeviceError
    if no worker is left.
    """
    while True:
        member = dispatch.wait_for()[0]
        answer = dispatch.cluster.ask(member.address, f"clrt-ask-{uuid4().hex}", function, *arguments)
        with suppress(*LOST):
            if _is_there(dispatch, member, answer):
                try:
                    return answer.result().result()
                except LookupError:
                    dispatch.meet_again(member)


def _is_there(dispatch: Dispatch, member: WorkerState, answer: Future[Any]) -> bool:
    """Wait for an answer; return False if its worker, or the scheduler, is lost first."""
    while not answer.done():
        if not dispatch.cluster.alive or dispatch.members.get(member.address) is not member:
            return False
        dispatch.meet()
    return True
