"""Rate at which a render yields its state."""

from __future__ import annotations

import time

#: Minimum seconds between two states, and minimum interval as a multiple of the cost of computing a state.
STATE_SECONDS, STATE_COST = 0.5, 20


class StateInterval:
    """Timer for the states of one call of `passes`; the first one is due at once."""

    def __init__(self) -> None:
        self._next, self._begun = 0.0, 0.0

    @property
    def due(self) -> bool:
        """Whether a state is due; the caller must then compute it now, as its cost is measured from here."""
        self._begun = time.perf_counter()
        return self._begun >= self._next

    def made(self) -> None:
        """Schedule the next state according to the cost of this one, computed since it was due."""
        cost = time.perf_counter() - self._begun
        self._next = self._begun + max(STATE_SECONDS, STATE_COST * cost)
