"""Tests of products of parameters: a covering array is run by default, and the rest is the group `combinations`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations, product
from typing import Any

import pytest

Row = tuple[int, ...]


def covering(names: str, *factors: Iterable[Any], strength: int = 1) -> pytest.MarkDecorator:
    """Parametrize a test with all combinations of the factors' values.

    By default those of a covering array are run: each value (strength 1) or each pair of values of two factors
    (strength 2) occurs. The others are marked `combinations`.
    """
    values = [list(factor) for factor in factors]
    chosen = covering_array([len(each) for each in values], strength)
    return pytest.mark.parametrize(names, [
        pytest.param(*(each[i] for each, i in zip(values, row)),
                     marks=() if row in chosen else pytest.mark.combinations)
        for row in product(*(range(len(each)) for each in values))])


def others(*cases: Any) -> list[Any]:
    """Parameters, tuples where there are several, that are not run by default but marked `combinations`."""
    return [pytest.param(*(case if isinstance(case, tuple) else [case]), marks=pytest.mark.combinations)
            for case in cases]


def covering_array(sizes: Sequence[int], strength: int) -> set[Row]:
    """Rows of indices below `sizes` that hold all combinations of indices of any `strength` columns.

    Greedily, always the row with the most that are missing; of equal ones the first.
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
