"""Results of one part of a check: figures and failures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Figure = float | str


@dataclass
class Findings:
    """Failures, one sentence each, and figures: what was measured, whether or not it is acceptable."""

    failures: list[str] = field(default_factory=list)
    figures: dict[str, Figure] = field(default_factory=dict)

    def expect(self, right: NDArray[np.bool_], what: str, *shown: tuple[str, NDArray[Any]]) -> None:
        """Record a failure named `what` unless all of `right` (n,) is true.

        shown: names and values (n, …), reported for the first one that is wrong.
        """
        wrong = np.flatnonzero(~right)
        if len(wrong):
            first = ", ".join(f"{name} {values[wrong[0]]}" for name, values in shown)
            self.failures.append(f"{what}: {len(wrong)} of {len(right)} wrong; {first}")

    def same(self, got: NDArray[Any], exact: NDArray[Any], what: str, *operands: NDArray[Any]) -> None:
        """Record a failure unless `got` equals `exact`, both (n,) of one dtype, to the bit; all NaNs are equal."""
        bits = np.dtype(f"u{got.itemsize}")
        right = got.view(bits) == exact.astype(got.dtype).view(bits)
        if got.dtype.kind == "f":
            right |= np.isnan(got) & np.isnan(exact)
        names = [("of", operand) for operand in operands]
        self.expect(right, what, *names, ("gave", got), ("not", exact))

    def at_most(self, limit: float, errors: NDArray[np.float64], what: str, unit: str, *operands: NDArray[Any]) -> None:
        """Record the largest of all `errors` (n,) for `what` as a figure, and a failure if one is above `limit`."""
        figure = f"{what}, {unit}"
        worst = float(np.max(errors, where=np.isfinite(errors), initial=float(self.figures.get(figure, 0.0))))
        self.figures[figure] = round(worst, 3)
        names = [("of", operand) for operand in operands]
        self.expect(errors <= limit, f"{what} within {limit:g} {unit}", *names, ("off by", errors))
