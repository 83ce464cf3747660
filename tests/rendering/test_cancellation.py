"""Cancelled computations leave what they were to change as it was."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.rendering.cancellation import NEVER, CancellationToken, Cancelled, StopRequests
from clrt.rendering.compile.records import PIXEL
from clrt.rendering.error_estimate.convergence import Convergence
from clrt.rendering.film.film import Film
from clrt.rendering.film.row_bands import bands_of, in_bands

SIZE = (256, 1024)


def film(spp: int) -> Film:
    """Return a film of random samples, of more than one band."""
    rng, pixels = np.random.default_rng(spp), np.zeros(SIZE, PIXEL)
    samples = rng.random((spp, *SIZE, 3))
    pixels["sum"], pixels["square"], pixels["count"] = samples.sum(0), (samples**2).sum(0), spp
    return Film(pixels)


class After:
    """Request that comes after a number of checks."""

    def __init__(self, checks: int) -> None:
        self.left = checks

    def __call__(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_bands_are_computed_until_the_request() -> None:
    bands, done = len(bands_of(SIZE)), list[slice]()
    assert bands > 2
    with pytest.raises(Cancelled):
        in_bands(SIZE, done.append, CancellationToken(After(2)))
    assert len(done) == 2
    assert len(in_bands(SIZE, done.append, NEVER)) == bands


@pytest.mark.parametrize("checks", [0, 3, len(bands_of(SIZE)) + 2])
def test_a_cancelled_state_changes_no_estimate(checks: int) -> None:
    """Cancelled at once, in the film's variance and in its difference from the last one; then made after all."""
    tiles = np.full((SIZE[0] // 8, SIZE[1] // 8), 1)
    cancelled, expected = Convergence(None, None), Convergence(None, None)
    for each in (cancelled, expected):
        each.record(film(1), tiles, 1.0)
    seen = film(2)
    with pytest.raises(Cancelled):
        cancelled.record(seen, 2 * tiles, 2.0, token=CancellationToken(After(checks)))
    assert [entry["spp"] for entry in cancelled.history] == [1]
    states = cancelled.record(seen, 2 * tiles, 2.0), expected.record(film(2), 2 * tiles, 2.0)
    assert states[0].noise == states[1].noise is not None
    for found, wanted in zip(cancelled.noise.arrays(), expected.noise.arrays()):
        np.testing.assert_array_equal(found, wanted)


def test_an_interrupt_does_not_cancel_the_last_state() -> None:
    requests = StopRequests()
    requests.interrupt()
    requests.token_of_last().check()
    with pytest.raises(Cancelled):
        requests.token().check()
    requests.abandon()
    with pytest.raises(Cancelled):
        requests.token_of_last().check()
