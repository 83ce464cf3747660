"""Faces of OBJ files on lines that are all alike."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.formats.digit_words import padded
from clrt.formats.wavefront.regular_faces import regular_faces

#: Each kind of corner, and which of the three indices it has.
KINDS = {"{0}": [0], "{0}/{1}": [0, 1], "{0}//{2}": [0, 2], "{0}/{1}/{2}": [0, 1, 2]}


@settings(max_examples=60, deadline=None)
@given(st.data(), st.sampled_from(sorted(KINDS)), st.integers(3, 6), st.integers(1, 5))
def test_indices_are_those_on_the_lines(data: st.DataObject, kind: str, corners: int, lines: int) -> None:
    indices = st.tuples(*[st.integers(1, 10**8 - 1)] * 3)
    faces = data.draw(st.lists(st.lists(indices, min_size=corners, max_size=corners), min_size=lines, max_size=lines))
    text = "\n".join("f " + " ".join(kind.format(*corner) for corner in face) for face in faces)
    found = regular_faces(padded(text.encode()))
    expected = np.zeros((3, lines, corners), np.int32)
    expected[KINDS[kind]] = np.array(faces).transpose(2, 0, 1)[KINDS[kind]]
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "f 1 2",
        "f 1 2 3\nf 1 2 3 4",
        "f 1 2 3 ",
        "f 1  2 3",
        "f 1 2 -3",
        "f 1 2 3.5",
        "f 1 2 3#",
        "f 1 2 x3",
        "f 1 2 123456789",
        "f 1/2 3 4",
        "f 1/ 2/ 3/",
        "f /1 /2 /3",
        "f 1//2 3//4 5/6/7",
        "f 1//2 3//4 5//6\nf 1/2/3 4/5/6 7/8/9",
        "f 1/2/3/4 1/2/3/4 1/2/3/4",
        "f 1//2/3 4//5/6 7//8/9",
    ],
)
def test_other_lines_are_left_alone(text: str) -> None:
    assert regular_faces(padded(text.encode())) is None
