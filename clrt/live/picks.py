"""Queue of picking requests: any thread asks for the first hit at an image position, the rendering thread answers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future

from ..scene.model import Instance, Mesh, Sphere

Thing = Mesh | Instance | Sphere


class PickRequests:
    """Picking requests that are not answered yet."""

    def __init__(self) -> None:
        self._asked: deque[tuple[float, float, Future[Thing | None]]] = deque()

    def __bool__(self) -> bool:
        return bool(self._asked)

    def ask(self, x: float, y: float) -> Future[Thing | None]:
        """Return a future of what is at (x, y), None for the sky; the corners are (0, 0), upper left, and (1, 1)."""
        found: Future[Thing | None] = Future()
        self._asked.append((x, y, found))
        return found

    def answer(self, seen_at: Callable[[float, float], Thing | None]) -> None:
        """Answer all requests."""
        while self._asked:
            x, y, found = self._asked.popleft()
            if not found.set_running_or_notify_cancel():
                continue  # the request was cancelled
            try:
                thing = seen_at(x, y)
            except Exception as error:  # any error is passed to the caller of `ask`
                found.set_exception(error)
            else:
                found.set_result(thing)

    def cancel(self) -> None:
        """Cancel all remaining requests."""
        while self._asked:
            self._asked.popleft()[-1].cancel()
