"""What is seen at places of a picture: any thread asks, the one that renders answers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future

from ..scene.model import Instance, Mesh, Sphere

Thing = Mesh | Instance | Sphere


class Picks:
    """Those that are not answered yet."""

    def __init__(self) -> None:
        self._asked: deque[tuple[float, float, Future[Thing | None]]] = deque()

    def __bool__(self) -> bool:
        return bool(self._asked)

    def ask(self, x: float, y: float) -> Future[Thing | None]:
        """What is at (x, y), or None for the sky; (0, 0) is the picture's upper left corner, (1, 1) its lower right."""
        found: Future[Thing | None] = Future()
        self._asked.append((x, y, found))
        return found

    def answer(self, seen_at: Callable[[float, float], Thing | None]) -> None:
        """Answers all."""
        while self._asked:
            x, y, found = self._asked.popleft()
            if not found.set_running_or_notify_cancel():
                continue    # nobody waits for it any more
            try:
                thing = seen_at(x, y)
            except Exception as error:    # whatever it is, it is who asked that must know
                found.set_exception(error)
            else:
                found.set_result(thing)

    def cancel(self) -> None:
        """Has nobody wait for the others any more."""
        while self._asked:
            self._asked.popleft()[-1].cancel()
