"""The operations of kernels/check/floats.cl: reference results and operands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.open import Device
from .exact_floats import Floats, fused
from .kernel_calls import CheckProgram

#: SIMD widths and the suffixes of their types: scalars, as on GPUs, and vectors of eight. All devices are checked with
#: both.
LANES = {1: "", 8: "8"}
COUNT = 2048

#: Operations on a, b, c with only one correct result.
EXACT: dict[str, Callable[[Floats, Floats, Floats], NDArray[Any]]] = {
    "sum": lambda a, b, c: a + b,
    "difference": lambda a, b, c: a - b,
    "product": lambda a, b, c: a * b,
    "copysign": lambda a, b, c: np.copysign(a, b),
    "fabs": lambda a, b, c: np.abs(a),
    "absolute": lambda a, b, c: np.abs(a),
    "minimum": lambda a, b, c: np.where(a < b, a, b),
    "maximum": lambda a, b, c: np.where(a > b, a, b),
    "chosen": lambda a, b, c: np.where(a < b, a, c),
    "floor": lambda a, b, c: np.floor(a),
    "ceil": lambda a, b, c: np.ceil(a),
}
#: The same, for normal numbers below 2^31.
NORMAL: dict[str, Callable[[Floats, Floats, Floats], NDArray[Any]]] = {
    "fma": fused,
    "neighbour": lambda a, b, c: np.nextafter(a, b),
    "to_int": lambda a, b, c: a.astype(np.int32),
    "to_uint": lambda a, b, c: np.abs(a).astype(np.uint32),
}
COMPARISONS: dict[str, Callable[[Floats, Floats], NDArray[np.bool_]]] = {
    "less": lambda a, b: a < b,
    "less_equal": lambda a, b: a <= b,
    "greater": lambda a, b: a > b,
    "greater_equal": lambda a, b: a >= b,
    "equal": lambda a, b: a == b,
    "unequal": lambda a, b: a != b,
    "not_less": lambda a, b: ~(a < b),
}
#: Operations on a >= 0, b and 0 <= c < 1 with an error limit in units in the last place (OpenCL 1.2, 7.4).
LIMITS: dict[str, tuple[float, Callable[..., NDArray[Any]]]] = {
    "quotient": (2.5, lambda a, b, c: a / b),
    "reciprocal": (2.5, lambda a, b, c: 1 / a),
    "sqrt": (3.0, lambda a, b, c: np.sqrt(a)),
    "rsqrt": (2.0, lambda a, b, c: 1 / np.sqrt(a)),
    "atan2": (6.0, lambda a, b, c: np.arctan2(a, b)),
    "exp": (3.0, lambda a, b, c: np.exp(16 * c)),
}
ROWS = (*EXACT, *NORMAL, *COMPARISONS, *LIMITS, "contraction", "mix", "fmin", "fmax")


def float_rows(device: Device, lanes: int, a: Floats, b: Floats, c: Floats) -> dict[str, NDArray[np.uint32]]:
    """Return the device's results for (n,) operands, as bits, by operation."""
    padded = np.resize(np.stack([a, b, c], axis=1), (-(-len(a) // 8) * 8, 3))
    rows = CheckProgram(device, "floats", lanes, ROWS).rows("floats", lanes, padded.T)
    return {name: row[: len(a)] for name, row in rows.items()}


def operands() -> tuple[Floats, Floats, Floats]:
    """Return a, b, c, (COUNT,) each, whose sums and products round up, down and from halfway; a·b + c nearly vanishes.

    No result leaves the range of normal floats.
    """
    rng, i = np.random.default_rng(1), np.arange(COUNT)
    digits, exponents = rng.integers(1 << 23, 1 << 24, (3, COUNT)), rng.integers(-20, 20, (3, COUNT))
    exponents[1] = np.where(i % 2, exponents[1], exponents[0] + rng.integers(-24, 25, COUNT))
    a, b, c = (rng.choice([-1, 1], (3, COUNT)) * digits * 2.0 ** (exponents - 23)).astype(np.float32)
    b = np.where(i % 8 == 0, np.spacing(a) / 2, b)  # a + b is halfway between two floats
    odd = (1 + (digits[0] % 4096 | 1) / 4096).astype(np.float32)
    a, b = np.where(i % 8 == 1, odd, a), np.where(i % 8 == 1, odd, b)  # a·b is
    return a, b, np.where(i % 3 == 0, -(a * b), c)
