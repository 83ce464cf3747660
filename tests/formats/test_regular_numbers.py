"""Numbers of one form, compared with Python's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.formats.digit_words import MARGIN, padded, runs
from clrt.formats.regular_numbers import decimals, fields

WORDS = r"[-+]?[0-9]{0,9}\.?[0-9]{0,4}([eE][-+]?[0-9]{0,3})?|[x.,/e-]{1,4}"
finite = st.floats(-1e8, 1e8)
#: Forms that are parsed for all numbers in the range, unless they get too long.
FORMS = ["%.0f", "%#.0f", "%.1f", "%.4f", "%.6f", "%.7f", "%.8f", "%.14f", "%.3e", "%.6E", "%.13e", "%d"]


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FORMS), st.lists(finite, min_size=1, max_size=12))
def test_numbers_of_one_form_are_those_of_python(form: str, numbers: list[float]) -> None:
    words = [form % number for number in numbers]
    text = padded(" ".join(words).encode())
    found = decimals(text, *runs(text > 32))
    longest = max(sum(letter.isdigit() for letter in word.lower().split("e")[0]) for word in words)
    least = min(abs(number) for number in numbers)
    assert (found is not None) or longest > 15 or ("e" in form.lower() and least < 1e-7)
    if found is not None:
        wanted = np.array(list(map(float, words)))
        assert np.array_equal(found, wanted) and np.array_equal(np.signbit(found), np.signbit(wanted))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(
        st.from_regex(r"[-+]?[0-9]{0,9}\.?[0-9]{0,4}([eE][-+]?[0-9]{0,3})?|[x.,/e-]{1,4}", fullmatch=True).filter(bool),
        min_size=1,
        max_size=4,
    )
)
def test_other_words_are_left_alone(words: list[str]) -> None:
    """Whatever is parsed has the values of Python."""
    text = padded(" ".join(words).encode())
    found = decimals(text, *runs(text > 32))
    if found is not None:
        assert found.tolist() == list(map(float, words))


@pytest.mark.parametrize(
    "words", ["10.5123 12", "1.5 1,5", "1.5 15", "15 1.5", "1e+01 1e*01", "1.5 +1.5", "1:5", "1.5e+0: 1.5e+01"]
)
def test_words_of_other_forms(words: str) -> None:
    text = padded(words.encode())
    assert decimals(text, *runs(text > 32)) is None


def test_fields() -> None:
    text = padded(b"f 1/22 3\nf 4/5 66")
    found = fields(text, text < ord("0"))
    assert found is not None and bytes(found.separators) == b" / \n"
    assert (found.starts - MARGIN).tolist() == [0, 2, 4, 7, 9, 11, 13, 15]
    assert (found.ends - found.starts).tolist() == [1, 1, 2, 1, 1, 1, 1, 2]
    rest = found.without_first()
    assert bytes(rest.separators) == b"/ \n" and (rest.starts - MARGIN).tolist() == [2, 4, 7, 11, 13, 15]


@pytest.mark.parametrize("text", ["", "1 2\n3\n", "1 2\n3/4\n", "1 2\n3 4\n5\n"])
def test_lines_with_different_fields(text: str) -> None:
    given = padded(text.encode())
    assert fields(given, given < ord("0")) is None
