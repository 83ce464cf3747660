"""Tables of races for `clrt bench`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def race_table(title: str, kinds: Mapping[str, Any], on_cpu: bool, *, agrees: bool = True) -> list[str]:
    """Return a line per contestant.

    The columns for each kind of rays are rays/s, the time per ray relative to the first contestant's, and (on a CPU)
    the same of processor time; the last column is the fraction of rays for which results agree.
    """
    columns = f"{'rays/s':>9}{'time':>6}" + (f" ({'CPU':>5})" if on_cpu else " " * 8)
    lines = [
        f"  {title:24}" + "".join(f"{kind:>23}" for kind in kinds),
        f"  {'':24}" + columns * len(kinds) + "    agrees" * agrees,
    ]
    for name in next(iter(kinds.values())):
        line = f"  {name:24}"
        for kind in kinds.values():
            row = kind[name]
            line += f"{_rate(1e6 * row['mrays']):>9}{_times(row['ratio']):>6}"
            line += f" ({_times(row['cpu_ratio']):>5})" if on_cpu else " " * 8
        lines.append(line + f"{min(kind[name]['agrees'] for kind in kinds.values()):10.5f}" * agrees)
    return lines


def race_legend(on_cpu: bool) -> str:
    """Explain the columns of `race_table`."""
    return f"  time{' (CPU: processor time)' if on_cpu else ''}: per ray, over the first line's; above 1 is slower"


def _rate(rays: float) -> str:
    return f"{1e-6 * rays:.3g}M" if rays >= 1e6 else f"{1e-3 * rays:.3g}k" if rays >= 1e3 else f"{rays:.3g}"


def _times(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 100 else f"{ratio:.0f}" if ratio < 10_000 else f"{ratio / 1000:.0f}k"
