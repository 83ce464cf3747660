"""A line of `clrt bench numerics`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """What one hard case gave. case: its number, "G1" … "L10"; what: the setting, in words.

    wrong: how many of `count` answers cannot be right: 0 is asked of the defaults. figure, unit: what else was
    measured, if anything, such as the largest error of t in units in the last place ("ulp").
    """

    case: str
    what: str
    count: int
    wrong: int
    figure: float | None = None
    unit: str = ""
