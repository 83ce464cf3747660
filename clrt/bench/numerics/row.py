"""Result row of `clrt bench numerics`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """Result of one hard case. case: its number, "G1" … "L10"; what: the setting, in words.

    wrong: how many of `count` results are impossible; defaults must have 0. figure, unit: a further measurement, if
    any, such as the largest error of t in units in the last place ("ulp").
    """

    case: str
    what: str
    count: int
    wrong: int
    figure: float | None = None
    unit: str = ""
