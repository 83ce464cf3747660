"""Asks one worker of a cluster for something, and another one where that is gone meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from .dispatch import LOST, Dispatch

if TYPE_CHECKING:
    from distributed import Future

    from .members import Member


def ask(dispatch: Dispatch, function: Callable[..., Any], *arguments: Any) -> Any:
    """What the function returns on a worker that is ready, or raises there. One that has forgotten the scene is met
    again; tasks go on being heard. DeviceError where no worker is left."""
    while True:
        member = dispatch.wait_for()[0]
        answer = dispatch.cluster.ask(member.address, f"clrt-ask-{uuid4().hex}", function, *arguments)
        with suppress(*LOST):
            if _is_there(dispatch, member, answer):
                try:
                    return answer.result().result()
                except LookupError:
                    dispatch.meet_again(member)


def _is_there(dispatch: Dispatch, member: Member, answer: Future[Any]) -> bool:
    """Waits for an answer; False where its worker, or the scheduler, is gone before."""
    while not answer.done():
        if not dispatch.cluster.alive or dispatch.members.get(member.address) is not member:
            return False
        dispatch.meet()
    return True
