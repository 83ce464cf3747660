"""Tables of races, as `clrt bench` prints them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def race_table(title: str, kinds: Mapping[str, Any], on_cpu: bool, *, agrees: bool = True) -> list[str]:
    """A line for each contestant, a column for each kind of rays, and the part of the rays for which answers agree.

    A column has Mrays/s, how many times as fast the first contestant is, and (on a CPU) that by processor time.
    """
    lines = [f"  {title:24}" + "".join(f"{kind:>23}" for kind in kinds) + "    agrees" * agrees]
    for name in next(iter(kinds.values())):
        line = f"  {name:24}"
        for kind in kinds.values():
            row = kind[name]
            line += f"{row['mrays']:9.3g}{_times(row['ratio']):>6}"
            line += f" ({_times(row['cpu_ratio']):>5})" if on_cpu else " " * 8
        lines.append(line + f"{min(kind[name]['agrees'] for kind in kinds.values()):10.5f}" * agrees)
    return lines


def _times(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 100 else f"{ratio:.0f}" if ratio < 10_000 else f"{ratio / 1000:.0f}k"
