"""Check that a Dask scheduler answers at an address before Dask's client connects, which may wait there forever."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

from ..threads import Event, beside


def check_scheduler(address: str, seconds: float) -> None:
    """Raise OSError, ValueError or TypeError unless a scheduler at the address identifies itself within `seconds`.

    This runs in a thread, as host name resolution cannot be interrupted; such a thread is abandoned.
    """
    ended, outcome = Event(), list[BaseException | None]()

    def ask() -> None:
        try:
            asyncio.run(asyncio.wait_for(_check_kind(address), seconds))
            outcome.append(None)
        except BaseException as error:  # raised again below
            outcome.append(error)
        ended.set()

    beside(ask, daemon=True)
    if not ended.wait(seconds + 1):
        raise OSError(f"no answer within {seconds:g} s")
    if isinstance(error := outcome[0], TimeoutError):
        raise OSError(f"no answer within {seconds:g} s") from error
    if isinstance(error, OSError | ValueError | TypeError):
        raise error
    if error is not None:  # Dask may raise any error on another protocol's bytes
        raise OSError("its answer is not a scheduler's") from error


async def _check_kind(address: str) -> None:
    from distributed.core import rpc
    from distributed.security import Security

    server: Any = rpc(address, connection_args=Security().get_connection_args("client"))
    try:
        kind = (await server.identity()).get("type")
    finally:
        with suppress(Exception):
            await server.close_rpc()
    if kind != "Scheduler":
        raise OSError(f"a Dask {str(kind).lower()} answers, not a scheduler")
