"""How large a picture may be to come in time."""

from __future__ import annotations

from .settings import scaled

#: By what sides are divided: few numbers, so that sizes change seldom.
DIVISORS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
#: A larger size than the last one must be expected to leave so much of the time over.
SPARE = 0.25
#: Of the time of a picture at least this part is for rendering it, whatever its preparation takes.
LEAST_PART = 0.25


class Pace:
    """Knows how long pictures took, and says how large the next one may be."""

    def __init__(self) -> None:
        self._divisor = DIVISORS[6]
        self._preparation, self._sample = 0.0, 0.0  # seconds

    def note(self, size: tuple[int, int], samples: int, preparation: float, seconds: float) -> None:
        """A picture of (width, height) took so long to prepare, and then so long for so many samples a pixel."""
        sample = seconds / (size[0] * size[1] * samples)
        self._sample = (self._sample or sample) / 2 + sample / 2
        self._preparation = (self._preparation or preparation) / 2 + preparation / 2

    def size(self, full: tuple[int, int], samples: int, seconds: float) -> tuple[int, int]:
        """What can be rendered with so many samples a pixel in the time."""
        left = max(seconds - self._preparation, LEAST_PART * seconds)
        whole = self._sample * full[0] * full[1] * samples / left
        if self._sample:
            spare = {each: 1 - SPARE if each < self._divisor else 1.0 for each in DIVISORS}
            self._divisor = next((each for each in DIVISORS if whole <= spare[each] * each**2), DIVISORS[-1])
        return scaled(full, 1 / self._divisor)
