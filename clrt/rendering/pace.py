"""How often a render shows its state."""

from __future__ import annotations

import time

#: Between two states at least this long passes, and this many times what making a state costs.
STATE_SECONDS, STATE_COST = 0.5, 20


class Pace:
    """Of one call of `passes`, whose first state is due at once."""

    def __init__(self) -> None:
        self._next, self._begun = 0.0, 0.0

    @property
    def due(self) -> bool:
        """Whether a state is, which begins to be made now if it is."""
        self._begun = time.perf_counter()
        return self._begun >= self._next

    def made(self) -> None:
        """Puts off the next state by what this one, made since it was due, has cost."""
        cost = time.perf_counter() - self._begun
        self._next = self._begun + max(STATE_SECONDS, STATE_COST * cost)
