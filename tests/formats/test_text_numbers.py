"""Numbers of text files, compared with Python's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.formats.digit_words import padded
from clrt.formats.text_numbers import floats, per_line, table

FORMATS = ["{!r}", "{:.6f}", "{:g}", "{:.3e}", "{:+.2E}", "{:.0f}.", "{:.18e}", "{:.25f}"]
numbers = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(-1e6, 1e6),
    st.integers(-(10**20), 10**20).map(float),
)
words = st.one_of(
    st.builds(str.format, st.sampled_from(FORMATS), numbers),
    st.from_regex(r"[-+]?[0-9]{0,22}\.?[0-9]{0,22}([eE][-+]?[0-9]{0,3})?", fullmatch=True).filter(bool),
    st.text("0123456789.-+eEx,/", min_size=1, max_size=8),
)


def value(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


@settings(max_examples=60, deadline=None)
@given(st.lists(st.lists(words, max_size=4), max_size=6))
def test_numbers_are_those_of_python(lines: list[list[str]]) -> None:
    """Up to the last place of float64, thus equal in float32, and malformed where Python says so."""
    text = padded("\n".join(" ".join(line) for line in lines).encode())
    with np.errstate(over="ignore"):
        found, starts, malformed = floats(text)
        expected = [value(word) for line in lines for word in line]
        wanted = np.array([np.nan if each is None else each for each in expected], np.float64)
        np.testing.assert_array_equal(found.astype(np.float32), wanted.astype(np.float32))
        np.testing.assert_array_max_ulp(np.nan_to_num(found), np.nan_to_num(wanted), 1)
    assert malformed.tolist() == [number for number, each in enumerate(expected) if each is None]
    assert per_line(text, starts)[: len(lines)].tolist() == [len(line) for line in lines][: len(per_line(text, starts))]


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="no extended precision")
def test_numbers_that_python_writes() -> None:
    """Of those with up to 17 digits, nearly all are equal to the last bit."""
    numbers = np.random.default_rng(1).normal(size=2000)
    found, _, _ = floats(padded("\n".join(map(repr, numbers.tolist())).encode()))
    assert np.mean(found == numbers) > 0.99


def test_undefined_values_of_c_libraries() -> None:
    found, _, malformed = floats(padded(b"-nan(ind) 1.#QNAN -1.#IND00 nan -1.#INF 1.#INF00 NaN -inf"))
    np.testing.assert_array_equal(found, [np.nan] * 4 + [-np.inf, np.inf, np.nan, -np.inf])
    assert malformed.size == 0


def test_table() -> None:
    values = np.arange(6.0)
    np.testing.assert_array_equal(table(values, np.array([3, 3]), 2), [[0, 1], [3, 4]])
    np.testing.assert_array_equal(
        table(values, np.array([1, 3, 2]), 3), [[0, np.nan, np.nan], [1, 2, 3], [4, 5, np.nan]]
    )
