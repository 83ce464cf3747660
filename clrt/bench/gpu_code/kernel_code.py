"""What a compiler made of one kernel: the record that all vendors' outputs are parsed to."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class KernelCode:
    """Resources of a kernel on one target; None where its compiler does not report them.

    registers: per work-item (NVIDIA, AMD's VGPRs), per hardware thread (Intel). spills: bytes stored and loaded
    (NVIDIA), registers (AMD), instructions (Intel). private_bytes: stack per work-item; local_bytes: per work-group.
    occupancy: warps per multiprocessor (NVIDIA), waves per SIMD unit (AMD), both as registers limit them, or SIMD
    width (Intel). loop_loads: instructions within loops by which each work-item loads from global memory; in a ray
    query, whose only loops are those of the traversal, those for a node and for a primitive.
    """

    target: str
    kernel: str
    registers: int
    spills: int
    private_bytes: int | None
    local_bytes: int
    occupancy: int
    instructions: int
    loop_loads: int | None = None
