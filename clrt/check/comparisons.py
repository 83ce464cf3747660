"""Check comparisons, selection and arithmetic of NaN, infinities and signed zeros."""

from __future__ import annotations

import numpy as np

from ..device.open import Device
from .findings import Findings
from .floats import COMPARISONS, EXACT, LANES, LIMITS, float_rows

SPECIAL = np.array([0.0, -0.0, 1.0, -1.0, 2.5, -3.75, np.inf, -np.inf, np.nan], np.float32)


def check_comparisons(device: Device, findings: Findings) -> None:
    """Check that NaN compares false, so that minimum and maximum return their second operand; check masks.

    Masks are 0 or 1, and −1 in vectors. Also checks the arithmetic of box tests for rays parallel to an axis: 1/0 =
    inf, 0·inf = NaN.
    """
    a, b, c = (grid.ravel() for grid in np.meshgrid(SPECIAL, SPECIAL, SPECIAL))
    for lanes in LANES:
        rows = float_rows(device, lanes, a, b, c)
        for name, compare in COMPARISONS.items():
            mask = np.where(compare(a, b), 1 if lanes == 1 else -1, 0).astype(np.int32)
            findings.same(rows[name].view(np.int32), mask, f"{name} of float{LANES[lanes]}", a, b)
        floats = {name: row.view(np.float32) for name, row in rows.items()}
        with np.errstate(all="ignore"):
            for name, exact in EXACT.items():
                findings.same(floats[name], exact(a, b, c), f"{name} of float{LANES[lanes]}", a, b, c)
            for name in ("quotient", "reciprocal", "sqrt"):
                truth = LIMITS[name][1](a, b, c)
                clear = ~np.isfinite(truth) | (truth == 0)  # no rounding is involved
                findings.same(floats[name][clear], truth[clear], f"{name} of float{LANES[lanes]}", a[clear], b[clear])
        for name, extreme in (("fmin", np.fmin), ("fmax", np.fmax)):
            truth = extreme(a, b)
            right = (floats[name] == truth) | (np.isnan(floats[name]) & np.isnan(truth))
            findings.expect(right, f"{name} of float{LANES[lanes]}", ("of", a), ("of", b), ("gave", floats[name]))
