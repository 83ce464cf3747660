"""Parametrization by covering arrays: the array's rows run by default, the rest are marked `combinations`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations, product
from typing import Any

import pytest

Row = tuple[int, ...]


def covering(names: str, *factors: Iterable[Any], strength: int = 1) -> pytest.MarkDecorator:
    """Parametrize a test with all combinations of the factors' values.

    By default only a covering array runs, in which each value (strength 1) or each pair of values of two factors
    (strength 2) occurs. The other combinations are marked `combinations`.
    """
    values = [list(factor) for factor in factors]
    chosen = covering_array([len(each) for each in values], strength)
    return pytest.mark.parametrize(
        names,
        [
            pytest.param(
                *(each[i] for each, i in zip(values, row)), marks=() if row in chosen else pytest.mark.combinations
            )
            for row in product(*(range(len(each)) for each in values))
        ],
    )


def others(*cases: Any) -> list[Any]:
    """Return parameters (tuples if there are several) that do not run by default but are marked `combinations`."""
    return [
        pytest.param(*(case if isinstance(case, tuple) else [case]), marks=pytest.mark.combinations) for case in cases
    ]


def covering_array(sizes: Sequence[int], strength: int) -> set[Row]:
    """Return rows of indices below `sizes` in which all combinations of indices of any `strength` columns occur.

    Greedy: adds the row with the most missing combinations; ties go to the first.
    """

    def held(row: Row) -> set[Any]:
        return set(combinations(enumerate(row), strength))

    rows = list(product(*map(range, sizes)))
    missing, chosen = set[Any]().union(*map(held, rows)), set[Row]()
    while missing:
        best = max(rows, key=lambda row: len(held(row) & missing))
        chosen.add(best)
        missing -= held(best)
    return chosen
