"""Tests of the covering arrays that select which combinations run by default."""

from __future__ import annotations

from itertools import combinations, product

import pytest

from .covering import covering, covering_array


@pytest.mark.parametrize("sizes", [(3,), (4, 3), (3, 3, 2), (5, 3, 2, 2)])
@pytest.mark.parametrize("strength", [1, 2])
def test_all_values_and_pairs_are_covered(sizes: tuple[int, ...], strength: int) -> None:
    """The array covers all tuples with at most two rows more than the product of the largest sizes."""
    rows = covering_array(sizes, strength)
    for columns in combinations(range(len(sizes)), strength):
        assert {tuple(row[i] for i in columns) for row in rows} == set(product(*(range(sizes[i]) for i in columns)))
    large = sorted(sizes)[-strength:]
    least = large[0] * large[-1] if len(large) == strength == 2 else large[-1] if strength == 1 else 0
    assert least <= len(rows) <= least + 2


def test_the_others_are_marked() -> None:
    mark = covering("letter, digit", "ab", range(3)).mark
    assert [(*each.values, len(each.marks)) for each in mark.args[1]] == [
        ("a", 0, 0),
        ("a", 1, 1),
        ("a", 2, 0),
        ("b", 0, 1),
        ("b", 1, 0),
        ("b", 2, 1),
    ]
