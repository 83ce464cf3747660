"""Adaptive resolution: the image size that can be rendered in a given time."""

from __future__ import annotations

from .settings import scaled

#: Divisors of the image's sides: few values, so that sizes change rarely.
DIVISORS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
#: Fraction of the time that must be left over before the size is increased.
SPARE = 0.25
#: Minimum fraction of the time for rendering, however long preparation takes.
LEAST_PART = 0.25


class ImageSizing:
    """Chooses the size of the next image from the times of previous ones."""

    def __init__(self) -> None:
        self._divisor = DIVISORS[6]
        self._preparation, self._sample = 0.0, 0.0  # seconds

    def note(self, size: tuple[int, int], samples: int, preparation: float, seconds: float) -> None:
        """Record how many seconds it took to prepare an image of (width, height), and to render `samples` per pixel."""
        sample = seconds / (size[0] * size[1] * samples)
        self._sample = (self._sample or sample) / 2 + sample / 2
        self._preparation = (self._preparation or preparation) / 2 + preparation / 2

    def size(self, full: tuple[int, int], samples: int, seconds: float) -> tuple[int, int]:
        """Return the size that can be rendered with this many samples per pixel in the given time."""
        left = max(seconds - self._preparation, LEAST_PART * seconds)
        whole = self._sample * full[0] * full[1] * samples / left
        if self._sample:
            spare = {each: 1 - SPARE if each < self._divisor else 1.0 for each in DIVISORS}
            self._divisor = next((each for each in DIVISORS if whole <= spare[each] * each**2), DIVISORS[-1])
        return scaled(full, 1 / self._divisor)
