"""The loop of `Renderer.passes`, step by step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..awake import AwakeClock
from .cancellation import Cancelled
from .film.film import Film
from .film.state import State
from .progress import Progress
from .state_interval import StateInterval
from .stop_conditions import StopConditions


@dataclass
class PassLoop:
    """One call of `Renderer.passes`: passes over the image until a stop condition is met.

    begun: launches of the next pass, the first of which runs already; None if it has not begun.
    """

    progress: Progress
    limits: StopConditions
    reference: NDArray[np.float32] | None
    watch: AwakeClock
    interval: StateInterval = field(default_factory=StateInterval)
    begun: Iterator[None] | None = None

    def states(self) -> Iterator[State]:
        """Render, yielding a state whenever one is due, and at the end. Ends without one if the image is abandoned."""
        progress = self.progress
        progress.session.mend()
        if self._stopped_before():
            yield progress.state(self.reference)
        while progress.stop_reason is None:
            self._render_pass()
            if progress.requests.abandoned:
                return
            done = progress.session.samples_done
            if not self._state_is_due(done):
                continue
            state = self._next_state(checks_error=self.limits.looks(done))
            if state is None:
                return
            self.interval.made()
            before = progress.stop_reason, progress.session.samples_done
            yield state
            if (progress.stop_reason, progress.session.samples_done) != before:  # another call rendered meanwhile
                self.watch.set(progress.seconds)
                self.begun = None
                if self._stopped_before():
                    yield progress.state(self.reference)

    def _stopped_before(self) -> bool:
        """Record what history lacks; return whether an earlier call or the resumed checkpoint met a stop condition."""
        progress, session = self.progress, self.progress.session
        progress.convergence.catch_up(session, progress.seconds)
        done = session.samples_done
        progress.stop_reason = self.limits.reached(done, progress.seconds)
        looks = progress.stop_reason is None and done and self.limits.looks(done) and not session.work.parts
        if looks and self.limits.low_enough(progress.state(None).stops_by):
            progress.stop_reason = "error"
        return progress.stop_reason is not None

    def _render_pass(self) -> None:
        """Render one pass; set the stop reason if `time` is over or the render is interrupted, even inside the pass."""
        progress, session = self.progress, self.progress.session
        launches, self.begun = self.begun or self._next_pass(), None
        for _ in launches:
            progress.seconds = self.watch.seconds
            progress.heed_interrupt()
            if progress.requests.abandoned or progress.in_haste:
                return
            if self.limits.time_over(session.samples_done, progress.seconds):
                progress.stop_reason = "time"
                return
            if session.work.parts:
                progress.save()

    def _next_pass(self) -> Iterator[None]:
        """Return a pass over the whole image, or an adaptive one that doubles the samples of the tiles where that
        reduces the error most. Stop the render if no tile is left."""
        progress, session = self.progress, self.progress.session
        if not self.limits.adapts(session.samples_done):
            return session.advance(self.limits.room)
        if not len(tiles := progress.convergence.tiles_to_double(session.tile_samples, self.limits.spp)):
            progress.stop_reason = "spp"
        return session.double(tiles)

    def _state_is_due(self, done: int) -> bool:
        """Return whether a state is due after `done` samples per pixel; it is at the end of the render, which may be
        here."""
        progress, limits = self.progress, self.limits
        progress.stop_reason = progress.stop_reason or limits.reached(done, progress.seconds)
        progress.heed_interrupt()
        due = self.interval.due or done & (done - 1) == 0 or limits.looks(done) or limits.adapts(done)
        return due or progress.stop_reason is not None

    def _next_state(self, checks_error: bool) -> State | None:
        """Return the state of the image, recorded in the history and saved; None if it is abandoned meanwhile.

        checks_error: whether to stop if the target error is reached.
        """
        progress, session = self.progress, self.progress.session
        session.wait()
        progress.seconds = self.watch.seconds
        film, tile_samples = session.film(), session.tile_samples
        self._begin_next_pass(checks_error)
        state = None if progress.in_haste else self._recorded(film, tile_samples)
        if progress.requests.abandoned:
            return None
        progress.heed_interrupt()
        if state is None:  # save first: the process may end soon
            progress.save(film, last=True)
            return progress.convergence.record(
                film, tile_samples, progress.seconds, self.reference, in_haste=self.begun is None
            )
        if progress.stop_reason is None and checks_error and self.limits.low_enough(state.stops_by):
            progress.stop_reason = "error"
        progress.save(film, last=progress.stop_reason is not None)
        return state

    def _begin_next_pass(self, checks_error: bool) -> None:
        """Start launches that run while the state is computed, if that neither decides about them nor saves them."""
        progress = self.progress
        if progress.stop_reason is None and not (checks_error or self.limits.adaptive or progress.checkpoints):
            self.begun = progress.session.advance_ahead(self.limits.room)

    def _recorded(self, film: Film, tile_samples: NDArray[np.int64]) -> State | None:
        """Return the state of the film, recorded in the history; None if a request to stop cancels that."""
        progress = self.progress
        try:
            return progress.convergence.record(
                film, tile_samples, progress.seconds, self.reference, token=progress.token()
            )
        except Cancelled:
            return None
