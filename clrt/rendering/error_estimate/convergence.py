"""Convergence of an image: its states over time, their estimated errors, and their history."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accumulation.accumulation import Accumulation
from ..cancellation import NEVER, CancellationToken
from ..film.film import Film
from ..film.state import State, relmse
from ..film.tiles import mean_samples
from .adaptive_sampling import tiles_to_double
from .error_estimate import NoiseEstimate


class Convergence:
    """Convergence of one image. history: entries of "spp", "seconds", "noise" and, with a reference, "relmse"; last:
    the newest state. planned_spp: see `NoiseEstimate`; percentile: see `State.tile_noise`."""

    last: State

    def __init__(self, planned_spp: int | None, percentile: float | None) -> None:
        self.noise, self._percentile = NoiseEstimate(planned_spp), percentile
        self.history: list[dict[str, Any]] = []

    def restore(self, noise: NoiseEstimate, history: list[dict[str, Any]]) -> None:
        """Resume from a saved state."""
        self.noise, self.history = noise, history

    def state(
        self,
        film: Film,
        tile_samples: NDArray[np.int64],
        seconds: float,
        reference: NDArray[np.float32] | None,
        in_haste: bool,
        token: CancellationToken = NEVER,
    ) -> State:
        """Return the state of the film, given the samples (rows, columns) of each tile and the elapsed seconds. If
        `in_haste`, the error estimate is not updated with this film. Raises Cancelled by the token."""
        if not in_haste:
            self.noise.add(film, tile_samples, token)
            if film.has_variance:
                film.relative_variance(token)
        noise = self.noise.at(self.last.film if in_haste and self.history else film, tile_samples)
        of_tiles = self.noise.of_tiles(tile_samples, film.size, self._percentile)
        spp = mean_samples(tile_samples, film.size)
        self.last = State(spp, seconds, noise, relmse(film, reference), film, of_tiles)
        return self.last

    def record(
        self,
        film: Film,
        tile_samples: NDArray[np.int64],
        seconds: float,
        reference: NDArray[np.float32] | None = None,
        in_haste: bool = False,
        token: CancellationToken = NEVER,
    ) -> State:
        """Return the state, and append it to the history unless `in_haste`. Raises Cancelled by the token."""
        state = self.state(film, tile_samples, seconds, reference, in_haste, token)
        entry = {"spp": state.spp, "seconds": state.seconds, "noise": state.noise}
        if not in_haste:
            self.history.append(entry if state.relmse is None else {**entry, "relmse": state.relmse})
        return state

    def tiles_to_double(self, tile_samples: NDArray[np.int64], spp: int | None) -> NDArray[np.intp]:
        """Return `adaptive.tiles_to_double` for the newest state."""
        return tiles_to_double(self.last.film, tile_samples, self.noise.tile_errors(tile_samples), spp)

    def catch_up(self, picture: Accumulation, seconds: float) -> None:
        """Record an image whose last state was computed in haste, unless it is in the middle of a pass."""
        done = picture.samples_done
        if done and not picture.work.parts and done != (self.history[-1]["spp"] if self.history else 0):
            self.record(picture.film(), picture.tile_samples, seconds)
