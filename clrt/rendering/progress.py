"""Progress of one image: its samples, convergence and elapsed time, and why it stopped."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from .accumulation.accumulation import Accumulation
from .cancellation import CancellationToken, StopRequests
from .checkpoint.checkpoints import Checkpoints
from .checkpoint.saved_state import SavedState
from .error_estimate.convergence import Convergence
from .film.film import Film
from .film.state import State


class Progress:
    """Progress of one image after another; `begin` starts the next.

    session: its samples; planned_spp, percentile: see `Convergence`; checkpoints: where its state is saved, if it is.
    """

    def __init__(
        self, session: Accumulation, planned_spp: int | None, percentile: float | None, checkpoints: Checkpoints | None
    ) -> None:
        self.session, self._planned_spp, self._percentile = session, planned_spp, percentile
        self.checkpoints, self.requests = checkpoints, StopRequests()
        self.begin()

    def begin(self) -> None:
        """Reset to an image without samples."""
        self.convergence = Convergence(self._planned_spp, self._percentile)
        self.stop_reason: str | None = None
        self.seconds = 0.0

    def restore(self, kept: SavedState) -> None:
        """Resume from a saved state."""
        self.convergence.restore(kept.noise, kept.history)
        self.session.restore(kept.film, kept.work)
        self.seconds = kept.seconds
        self.state(None)

    @property
    def in_haste(self) -> bool:
        """Whether the render was interrupted: estimate and history exclude the last pass until it is resumed."""
        return self.stop_reason == "interrupted"

    def heed_interrupt(self) -> None:
        """Stop if that was requested and no other condition was met before."""
        if self.stop_reason is None and self.requests.interrupted:
            self.stop_reason, self.requests.interrupted = "interrupted", False

    def token(self) -> CancellationToken:
        """Return the token for the next state: an interrupt does not cancel the last one of an image."""
        return self.requests.token() if self.stop_reason is None else self.requests.token_of_last()

    def state(self, reference: NDArray[np.float32] | None) -> State:
        """Return the current state, also in the middle of a pass."""
        film, tile_samples = self.session.film(), self.session.tile_samples
        return self.convergence.state(film, tile_samples, self.seconds, reference, self.in_haste)

    def save(self, film: Film | None = None, last: bool = False) -> None:
        """Write a checkpoint if one is due, or start writing the last one; film: the current film, if known."""
        if self.checkpoints is not None and (last or self.checkpoints.due):
            write = self.checkpoints.begin if last else self.checkpoints.write
            write(
                SavedState(
                    self._planned_spp,
                    self.seconds,
                    self.convergence.history,
                    film or self.session.film(),
                    self.session.work_left(),
                    self.convergence.noise,
                )
            )

    @property
    def saves_unfinished(self) -> bool:
        """Whether a checkpoint is written if `passes` is left before its end: not once threads have ended."""
        return self.checkpoints is not None and not self.requests.abandoned and not sys.is_finalizing()
