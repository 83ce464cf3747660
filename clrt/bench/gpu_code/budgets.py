"""Budgets of kernels: limits by kernel and target, in one table."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files

from .kernel_code import KernelCode

#: Columns of the table that are upper limits; the column occupancy is a lower one.
MOST = ("registers", "spills", "private_bytes", "local_bytes")


@dataclass(frozen=True)
class Budget:
    """A row of the table: patterns of programs, kernels and targets, and limits of resources by name."""

    program: str
    kernel: str
    target: str
    limits: dict[str, int]

    def covers(self, program: str, code: KernelCode) -> bool:
        """Return whether the row is about a kernel on a target."""
        pairs = (program, self.program), (code.kernel, self.kernel), (code.target, self.target)
        return all(fnmatchcase(name, pattern) for name, pattern in pairs)


@cache
def budgets() -> tuple[Budget, ...]:
    """Return the table budgets.csv. Of rows that cover a kernel, the last one with a limit counts."""
    lines = files(__package__).joinpath("budgets.csv").read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return tuple(
        Budget(
            row.pop("program"), row.pop("kernel"), row.pop("target"), {k: int(v) for k, v in row.items() if v.strip()}
        )
        for row in rows
    )


def past_budget(program: str, code: KernelCode, table: Sequence[Budget] | None = None) -> list[str]:
    """Return what a kernel has too much of, and of occupancy too little, with its limits; empty within its budget."""
    limits: dict[str, int] = {}
    for budget in budgets() if table is None else table:
        if budget.covers(program, code):
            limits |= budget.limits
    over = [name for name in MOST if name in limits and (getattr(code, name) or 0) > limits[name]]
    told = [f"{name.replace('_', ' ')} {getattr(code, name)} > {limits[name]}" for name in over]
    if code.occupancy < limits.get("occupancy", 0):
        told.append(f"occupancy {code.occupancy} < {limits['occupancy']}")
    return told
