"""Work-groups: how many warps they let run at once, and how long they hold their places."""

from __future__ import annotations

from .gpus import Gpu
from .visits import Ints


def warps_in_groups(gpu: Gpu, registers: int, group: int) -> int:
    """Return the resident warps of a core if whole groups of `group` lanes must fit."""
    fitting, of_group = gpu.schedulers * gpu.in_flight(registers), max(1, group // gpu.width)
    return fitting // of_group * of_group


def held(work: Ints, warps: int) -> float:
    """Return the fraction of time that warps work while their group of `warps` stays, until its last one ends.

    work: of each warp, (n,), in the order of the groups.
    """
    whole = work[: len(work) // warps * warps].reshape(-1, warps)
    return float(whole.mean() / whole.max(axis=1).mean()) if whole.size else 1.0
