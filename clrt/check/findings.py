"""What one part of a check finds out: figures, and what is wrong."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Figure = float | str


@dataclass
class Findings:
    """failures: a sentence for each thing that is wrong. figures: what was measured, whether or not that is fine."""

    failures: list[str] = field(default_factory=list)
    figures: dict[str, Figure] = field(default_factory=dict)

    def expect(self, right: NDArray[np.bool_], what: str, *shown: tuple[str, NDArray[Any]]) -> None:
        """A failure named `what` unless all of `right` (n,) is true; names and values (n, …) tell of the first."""
        wrong = np.flatnonzero(~right)
        if len(wrong):
            first = ", ".join(f"{name} {values[wrong[0]]}" for name, values in shown)
            self.failures.append(f"{what}: {len(wrong)} of {len(right)} wrong; {first}")

    def same(self, got: NDArray[Any], exact: NDArray[Any], what: str, *operands: NDArray[Any]) -> None:
        """A failure unless `got` is `exact`, both (n,) of one dtype, to the bit; NaNs are all the same."""
        bits = np.dtype(f"u{got.itemsize}")
        right = got.view(bits) == exact.astype(got.dtype).view(bits)
        if got.dtype.kind == "f":
            right |= np.isnan(got) & np.isnan(exact)
        names = [("of", operand) for operand in operands]
        self.expect(right, what, *names, ("gave", got), ("not", exact))

    def at_most(self, limit: float, errors: NDArray[np.float64], what: str, unit: str,
                *operands: NDArray[Any]) -> None:
        """The largest of `errors` (n,) as a figure, of all calls for `what`; a failure where one is above `limit`."""
        figure = f"{what}, {unit}"
        worst = float(np.max(errors, where=np.isfinite(errors), initial=float(self.figures.get(figure, 0.0))))
        self.figures[figure] = round(worst, 3)
        names = [("of", operand) for operand in operands]
        self.expect(errors <= limit, f"{what} within {limit:g} {unit}", *names, ("off by", errors))
