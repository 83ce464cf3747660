"""Check integers of 8, 32 and 64 bits: wrap-around, products, shifts, bit counts and conversions; and long loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ..device.launches.driver_loop_limits import TURNS, measured_turns
from ..device.open import Device
from .exact_floats import nearest_float32
from .findings import Findings
from .floats import LANES
from .kernel_calls import CheckProgram

COUNT = 2048
#: Minimum number of loop iterations per work-item, needed to trace a path of depth eight.
LEAST_TURNS = 1 << 14
Operation = Callable[[int, int], int]


def signed(a: int) -> int:
    """Return the number whose 32-bit two's complement is a."""
    return a - (a >> 31 << 32)


def float_bits(a: int | float) -> int:
    """Return the bits of the float nearest to a."""
    return int(nearest_float32(Fraction(a)).view(np.uint32))


def octets(a: int) -> list[int]:
    """Return the four bytes of a, the lowest first."""
    return list(a.to_bytes(4, "little"))


#: Rows of kernels/check/integers.cl for a, and b > 0, in Python's unbounded integers, to be taken modulo 2^32.
INTEGERS: dict[str, Operation] = {
    "sum": lambda a, b: a + b,
    "difference": lambda a, b: a - b,
    "product": lambda a, b: a * b,
    "high_product": lambda a, b: a * b >> 32,
    "quotient": lambda a, b: a // b,
    "remainder": lambda a, b: a % b,
    "left": lambda a, b: a << b % 32,
    "right": lambda a, b: a >> b % 32,
    "signed_right": lambda a, b: signed(a) >> b % 32,
    "exclusive_or": lambda a, b: a ^ b,
    "inverse": lambda a, b: ~a,
    "negative": lambda a, b: -a,
    "ones": lambda a, b: a.bit_count(),
    "zeros_in_front": lambda a, b: 32 - a.bit_length(),
    "to_float": lambda a, b: float_bits(a),
    "signed_to_float": lambda a, b: float_bits(signed(a)),
}
COMPARISONS: dict[str, Callable[[int, int], bool]] = {
    "less": lambda a, b: a < b,
    "signed_less": lambda a, b: signed(a) < signed(b),
}
WORDS: dict[str, Operation] = {
    "low_product": lambda a, b: (a << 32 | b) * 0x0101010101010101,
    "high_product": lambda a, b: (a << 32 | b) * 0x0101010101010101 >> 32,
    "low_shifted": lambda a, b: b << 20,
    "high_shifted": lambda a, b: (a << 32 | b) >> 12,
    "shifted_bytes": lambda a, b: sum(x << (y & 15) for x, y in zip(octets(a), octets(b))),
    "bytes_to_float": lambda a, b: float_bits(sum(octets(a)) / 4),
    "signed_byte": lambda a, b: (a & 255) - 2 * (a & 128),
    "float_to_byte": lambda a, b: 64 + (a & 0x7FFFFF) // (1 << 17),
}


def check_integers(device: Device, findings: Findings) -> None:
    """Check every row for random numbers and those at the ends of the range; check a long loop."""
    rng = np.random.default_rng(2)
    ends = np.array([0, 1, 2, 31, 32, 255, 256, (1 << 24) - 1, (1 << 24) + 1, (1 << 31) - 1, 1 << 31, (1 << 32) - 1])
    pairs = np.stack(np.meshgrid(ends, ends)).reshape(2, -1)
    spread = rng.integers(0, 1 << 32, (2, COUNT)) >> rng.integers(0, 32, (2, COUNT))
    inputs = np.concatenate([pairs, spread], axis=1).astype(np.uint32)
    inputs[1] = np.maximum(inputs[1], 1)
    for lanes in LANES:
        true = 1 if lanes == 1 else -1
        masks = {name: (lambda a, b, compare=compare: true * compare(a, b)) for name, compare in COMPARISONS.items()}
        _check_rows(
            CheckProgram(device, "integers", lanes, (*INTEGERS, *masks)),
            "integers",
            lanes,
            INTEGERS | masks,
            inputs,
            findings,
        )
    words = CheckProgram(device, "words", 1, tuple(WORDS))
    _check_rows(words, "words", 1, WORDS, inputs, findings)
    _check_loops(device, findings)


def _check_loops(device: Device, findings: Findings) -> None:
    """Check for drivers that limit loop iterations, as some that vectorise across work-items do.

    On those, launches are split (device/launches/driver_loop_limits.py).
    """
    turns = measured_turns(device)
    if turns is None:
        return
    findings.figures["iterations of a work-item's loops"] = turns
    if device.vectors or turns < LEAST_TURNS:
        findings.failures.append(f"a loop of {TURNS} iterations ends after {turns}")


def _check_rows(
    probe: CheckProgram,
    kernel: str,
    lanes: int,
    operations: Mapping[str, Operation],
    inputs: NDArray[np.uint32],
    findings: Findings,
) -> None:
    a, b = inputs
    for name, row in probe.rows(kernel, lanes, inputs).items():
        truth = [operations[name](x, y) % (1 << 32) for x, y in zip(a.tolist(), b.tolist())]
        findings.same(row, np.array(truth, np.uint32), f"{name} of uint{LANES[lanes]}", a, b)
