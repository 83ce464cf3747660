"""Check float arithmetic: sums, products and rounding by IEEE 754, division within OpenCL's limits."""

from __future__ import annotations

import numpy as np

from ..device.open import Device
from .exact_floats import Floats, fused, ulps
from .findings import Findings
from .floats import EXACT, LANES, LIMITS, NORMAL, float_rows, operands


def check_arithmetic(device: Device, findings: Findings) -> None:
    """Check sums, products and fma to the bit, division and roots within limits; record implementation choices."""
    for lanes in LANES:
        _check_exact(device, lanes, findings)
        _check_limits(device, lanes, findings)
        _check_denormals(device, lanes, findings)


def _check_exact(device: Device, lanes: int, findings: Findings) -> None:
    a, b, c = operands()
    rows = float_rows(device, lanes, a, b, c)
    for name, exact in (EXACT | NORMAL).items():
        truth = exact(a, b, c)
        findings.same(rows[name].view(truth.dtype), truth, f"{name} of float{LANES[lanes]}", a, b, c)
    got, once = rows["contraction"].view(np.float32), fused(a, b, c)
    findings.expect((got == once) | (got == a * b + c), f"a·b + c of float{LANES[lanes]}", ("gave", got), ("not", once))
    roundings = "rounded once" if np.array_equal(got, once) else "rounded twice"
    findings.figures[f"a·b + c of float{LANES[lanes]}"] = roundings


def _check_limits(device: Device, lanes: int, findings: Findings) -> None:
    a, b, c = operands()
    a, c = np.abs(a), c - np.floor(c)
    x, y, t = (values.astype(np.float64) for values in (a, b, c))
    rows = {name: row.view(np.float32) for name, row in float_rows(device, lanes, a, b, c).items()}
    for name, (limit, exact) in LIMITS.items():
        findings.at_most(limit, ulps(rows[name], exact(x, y, t)), name, "ulp", a, b, c)
    # With m = max(x, |y|), x + (y − x)·t rounds the difference and the product, up to 2 m, and the sum, up to m.
    roundings = np.abs(rows["mix"] - (x + (y - x) * t)) / (np.maximum(x, np.abs(y)) * 2.0**-24)
    findings.at_most(5.0, roundings, "mix", "roundings", a, b, c)


def _check_denormals(device: Device, lanes: int, findings: Findings) -> None:
    """Check that denormals are kept, or flushed to zero as inputs or results."""
    a = np.float32(2.0**-126) * np.array([1, 1.5, 0.75, 0.5, 2.0**-20, 1.25], np.float32)
    b = np.roll(a, 1)
    rows = float_rows(device, lanes, a, b, a)
    kept = True
    for name, operation in (("sum", np.add), ("difference", np.subtract)):
        got, truth, flushed = rows[name].view(np.float32), operation(a, b), operation(_flushed(a), _flushed(b))
        allowed = np.stack([truth, _flushed(truth), flushed, _flushed(flushed)])
        findings.expect(
            np.any(got == allowed, axis=0), f"{name} of tiny float{LANES[lanes]}", ("of", a), ("of", b), ("gave", got)
        )
        kept = kept and np.array_equal(got, truth)
    findings.figures[f"denormals of float{LANES[lanes]}"] = "kept" if kept else "flushed"


def _flushed(values: Floats) -> Floats:
    return np.where(np.abs(values) < np.float32(2.0**-126), np.float32(0), values)
