"""Numbers on lines that are all alike, as programs write them: parsed together, several times as fast as any text.

Each function returns None for other text, which its callers parse word by word.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .digit_words import (
    EXACT_POWER,
    MARGIN,
    OTHERS,
    POWERS,
    ZEROS,
    Bytes,
    Flags,
    Floats,
    Ints,
    Words,
    eight_digits,
    last_bytes,
    last_digits,
    scaled,
    with_other_bytes,
    words_at,
)

NEWLINE, SPACE, MINUS, PLUS, POINT, ZERO, NINE = b"\n -+.09"
#: Most digits of a number: those of two words, of which one may contain the point. Such integers are float64 values.
MOST_DIGITS = 15
_FORM = re.compile(rb"-?\d*(?P<point>\.(?P<places>\d{0,14}))?([eE][-+](?P<exponent>\d{1,3}))?")


class Fields(NamedTuple):
    """What is between single separators on lines of one layout, by line: starts and ends; and the separators after the
    fields of each line, (k,)."""

    starts: Ints
    ends: Ints
    separators: Bytes

    def without_first(self) -> Fields:
        """Return these without the first one of each line."""
        starts, ends = (places.reshape(-1, len(self.separators))[:, 1:].ravel() for places in self[:2])
        return Fields(starts, ends, self.separators[1:])


def fields(text: Bytes, is_separator: Flags) -> Fields | None:
    """Return the fields of a text between margins. Line feeds must be separators."""
    ends = np.flatnonzero(is_separator[MARGIN:-MARGIN])
    ends += MARGIN
    separators = text[ends]
    width = int((separators == NEWLINE).argmax()) + 1 if len(ends) else 1
    if not len(ends) or len(ends) % width or (separators.reshape(-1, width) != separators[:width]).any():
        return None
    starts = np.empty_like(ends)
    starts[0] = MARGIN
    np.add(ends[:-1], 1, out=starts[1:])
    return Fields(starts, ends, separators[:width])


def decimals(text: Bytes, starts: Ints, ends: Ints) -> Floats | None:
    """Parse words that are numbers of one form: with as many digits after the point, if there is one, and in the
    exponent. Values are correctly rounded."""
    form = _FORM.fullmatch(text[starts[0] : ends[0]].tobytes()) if len(starts) else None
    if form is None:
        return None
    places, powers = len(form["places"] or b""), None
    negative, stops = text[starts] == MINUS, ends
    if form["exponent"] is not None:
        stops = ends - (2 + len(form["exponent"]))
        powers = _exponents(text, stops, len(form["exponent"]))
        if powers is None:
            return None
        powers -= places
        if max(powers.max(), -powers.min()) > EXACT_POWER:
            return None
    mantissas = _mantissas(text, starts + negative, stops, places if form["point"] else None)
    if mantissas is None:
        return None
    if powers is not None:
        values = scaled(mantissas, powers)
        np.negative(values, out=values, where=negative)
        return values
    power = float(POWERS[places])
    return mantissas.astype(np.float64) / np.where(negative, -power, power)


def _exponents(text: Bytes, marks: Ints, count: int) -> Ints | None:
    """Return the exponents of so many digits whose "e" is at the marks."""
    sign = text[marks + 1]
    negative = sign == MINUS
    if not ((text[marks] | 0x20 == ord("e")) & (negative | (sign == PLUS))).all():
        return None
    exponents = np.zeros(len(marks), np.int64)
    for digit in range(count):
        values = text[marks + (2 + digit)] - ZERO
        if values.max() > 9:
            return None
        exponents = 10 * exponents + values
    return np.where(negative, -exponents, exponents)


def _mantissas(text: Bytes, starts: Ints, stops: Ints, places: int | None) -> Words | None:
    """Return the digits of words as integers. places: how many are after the point; None without one."""
    counts = stops - starts
    if places is not None:
        counts -= 1
        if (text[stops - (places + 1)] != POINT).any():
            return None
    if counts.min() < max(places or 0, 1) or counts.max() > MOST_DIGITS:
        return None
    values, others = np.zeros(len(counts), np.uint64), np.zeros(len(counts), np.uint64)
    for word, power in _digit_words(text, stops, counts, places):
        others |= with_other_bytes(word)
        word = eight_digits(word)
        values += word * POWERS[power] if power else word
    return None if np.bitwise_or.reduce(others) & OTHERS else values


def _digit_words(text: Bytes, stops: Ints, counts: Ints, places: int | None) -> Iterator[tuple[Words, int]]:
    """Yield words of digits, see `last_digits`, and the power of ten of the last one. counts: of all digits."""
    longest = int(counts.max())
    if places is None:
        for done in range(0, longest, 8):
            yield last_digits(text, stops - done, np.clip(counts - done, 0, 8)), done
    elif places < 8:  # the last word contains the point and seven digits
        word = words_at(text, stops - 8)
        word ^= ZEROS
        whole = np.uint64((1 << 8 * (8 - places)) - 1)
        yield last_bytes((word & ~whole) | (word << np.uint64(8) & whole), np.minimum(counts, 7)), 0
        if longest > 7:
            yield last_digits(text, stops - 8, np.clip(counts - 7, 0, 8)), 7
    else:
        for done in range(0, places, 8):
            yield last_digits(text, stops - done, np.array(min(places - done, 8))), done
        yield last_digits(text, stops - (places + 1), counts - places), places
