"""Distinct indices, compared with numpy's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.formats.used_indices import used_indices


@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.int32, np.uint32, np.int64])
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 120), st.integers(1, 5), st.lists(st.integers(0, 127), max_size=300))
def test_used_indices_are_those_of_numpy(dtype: type, least: int, spread: int, indices: list[int]) -> None:
    """Also where all are used, or few out of many."""
    given: Any = np.minimum(np.array(indices, np.int64) * spread + least, np.iinfo(dtype).max).astype(dtype)
    distinct, numbers = used_indices(given)
    expected, inverse = np.unique(given, return_inverse=True)
    np.testing.assert_array_equal(distinct, expected)
    np.testing.assert_array_equal(numbers, inverse)


def test_few_of_many() -> None:
    distinct, numbers = used_indices(np.array([2**40, 5, 2**40]))
    assert distinct.tolist() == [5, 2**40] and numbers.tolist() == [1, 0, 1]


def test_all_that_a_small_type_can_hold() -> None:
    given = np.arange(255, -1, -1).astype(np.uint8)
    distinct, numbers = used_indices(given)
    assert distinct.tolist() == list(range(256)) and numbers.tolist() == given.tolist()
