"""Requests to stop a render, and the token by which long computations notice that their result is not needed."""

from __future__ import annotations

from collections.abc import Callable

from ..threads import Event


class Cancelled(Exception):
    """Raised if the result of a computation is no longer needed."""


class CancellationToken:
    """Token that a computation checks from time to time. requested: returns whether to cancel it."""

    def __init__(self, requested: Callable[[], bool] = lambda: False) -> None:
        self._requested = requested

    def check(self) -> None:
        """Raise Cancelled if that is requested."""
        if self._requested():
            raise Cancelled


#: Token of computations that always end.
NEVER = CancellationToken()


class StopRequests:
    """Requests to stop a render, made by other threads and signal handlers."""

    def __init__(self) -> None:
        self.interrupted = False
        self._abandoned = Event()

    def interrupt(self) -> None:
        """Request to stop with a state and a checkpoint."""
        self.interrupted = True

    def abandon(self) -> None:
        """Request to stop at once, as the image is discarded."""
        self._abandoned.set()

    @property
    def abandoned(self) -> bool:
        """Whether the image is discarded."""
        return self._abandoned.is_set()

    def token(self) -> CancellationToken:
        """Return a token that is set by any request."""
        return CancellationToken(lambda: self.abandoned or self.interrupted)

    def token_of_last(self) -> CancellationToken:
        """Return a token for the last state of an image, which an interrupt does not cancel."""
        return CancellationToken(lambda: self.abandoned)
