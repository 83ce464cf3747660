"""Numbers in text files, parsed in array operations. Words that are not plain decimals are left to Python."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from ..threads import in_parallel
from .digit_words import (
    DIGITS,
    EXACT_POWER,
    POWERS,
    Bytes,
    Flags,
    Floats,
    Ints,
    digits,
    padded,
    runs,
    scaled,
)
from .regular_numbers import decimals, fields

#: Bytes that are parsed at a time.
BLOCK = 1 << 20
#: What C libraries print for undefined and infinite values, beyond what `float` accepts.
NAN, INFINITE = re.compile(rb"[-+]?(nan|1\.#(ind|qnan|snan))"), re.compile(rb"[-+]?1\.#inf")


def reuse_memory() -> None:
    """Make the GNU C library keep the memory of freed arrays of up to 30 MiB for later ones, as it does once it has
    freed one of this size. Otherwise page faults take a sixth of the time."""
    np.empty(30 << 20, np.uint8)


class TextNumbers(NamedTuple):
    """Numbers of a text up to the first word that is none; malformed: that word, or empty; counts: how many numbers are
    on each line that has any."""

    values: Floats
    counts: Ints
    malformed: str


def numbers(text: bytes, start: int = 0) -> TextNumbers:
    """Parse a text from `start` on in blocks, by as many threads as there are cores."""
    reuse_memory()
    blocks = list(_blocks(text, start))
    ends = list(accumulate(in_parallel(lambda limits: _count_words(text, *limits), blocks), initial=0))
    values, stops = np.empty(ends[-1]), list(ends)

    def parse(number: int) -> tuple[Ints, str]:
        block = _block(text[slice(*blocks[number])])
        stops[number] = ends[number] + len(block.values)
        values[ends[number] : stops[number]] = block.values
        return block.counts, block.malformed

    parsed = in_parallel(parse, range(len(blocks)))
    last = next((number for number, (_, word) in enumerate(parsed) if word), len(parsed) - 1)
    if last < 0:
        return TextNumbers(values, np.zeros(0, np.int64), "")
    counts = np.concatenate([counts for counts, _ in parsed[: last + 1]])
    return TextNumbers(values[: stops[last]], counts, parsed[last][1])


def _count_words(text: bytes, start: int, stop: int) -> int:
    in_word = np.frombuffer(text, np.uint8, stop - start, start) > ord(" ")
    return int(in_word[0]) + int(np.count_nonzero(in_word[1:] > in_word[:-1]))


def _blocks(text: bytes, start: int) -> Iterator[tuple[int, int]]:
    """Yield the start and the stop of blocks of whole lines."""
    while start < len(text):
        stop = text.find(b"\n", start + BLOCK) + 1 or len(text)
        yield start, stop
        start = stop


def _block(block: bytes) -> TextNumbers:
    text = padded(block)
    if (alike := fields(text, text <= ord(" "))) and (found := decimals(text, *alike[:2])) is not None:
        return TextNumbers(found, np.full(len(found) // len(alike.separators), len(alike.separators)), "")
    values, starts, malformed = floats(text)
    counts = per_line(text, starts)
    counts, word = counts[counts > 0], ""
    if malformed.size:
        values, place = values[: malformed[0]], int(starts[malformed[0]])
        word = text[place:].tobytes().split(None, 1)[0][:60].decode("utf-8", "backslashreplace")
    return TextNumbers(values, counts, word)


def per_line(text: Bytes, starts: Ints) -> Ints:
    """Return how many of the places `starts`, which ascend, are in each line."""
    ends = np.flatnonzero(text == ord("\n"))
    same = max(len(starts) // max(len(ends), 1), 1)
    first, last = starts[::same], starts[same - 1 :: same]
    if len(first) == len(last) == len(ends) and (last < ends).all() and (first[1:] > ends[:-1]).all():
        return np.full(len(ends), same)
    return np.diff(np.searchsorted(starts, ends), prepend=0)


def table(values: Floats, counts: Ints, width: int) -> Floats:
    """Return the first `width` numbers of each line, (n, width), NaN where it has fewer. counts: numbers per line."""
    if len(counts) and (counts == counts[0]).all():
        return values.reshape(len(counts), -1)[:, :width]
    columns = np.arange(width)
    places = np.minimum((np.cumsum(counts) - counts)[:, None] + columns, len(values) - 1)
    return np.where(columns < counts[:, None], values[places], np.nan)


def floats(text: Bytes) -> tuple[Floats, Ints, Ints]:
    """Parse the words between white space: their values, their starts, and the numbers of those that are malformed."""
    starts, ends = runs(text > ord(" "))
    values, malformed = floats_at(text, starts, ends)
    return values, starts, malformed


def floats_at(text: Bytes, starts: Ints, ends: Ints) -> tuple[Floats, Ints]:
    """Parse these words: their values, and the numbers of those that are malformed.

    Values are correctly rounded up to 15 digits, and within one unit of the last place of float64 beyond.
    """
    if (same := decimals(text, starts, ends)) is not None:
        return same, np.zeros(0, np.int64)
    stops, exponents, odd = _exponents(text, starts, ends)
    points = _positions(text == ord("."), starts, stops)
    first = text[starts]
    negative = first == ord("-")
    whole_digits = points - starts - (negative | (first == ord("+")))
    places = np.maximum(stops - points - 1, 0)
    count = whole_digits + places
    if count.min(initial=1) < 1 or count.max(initial=1) > DIGITS:
        odd |= (count < 1) | (count > DIGITS)
    powers = exponents - places
    if max(powers.max(initial=0), -powers.min(initial=0)) > EXACT_POWER:
        odd |= abs(powers) > EXACT_POWER
    whole, wrong = digits(text, points, whole_digits)
    odd |= wrong
    fraction, wrong = digits(text, stops, places)
    odd |= wrong
    mantissas = whole * POWERS.take(places, mode="clip") + fraction
    values = scaled(mantissas, np.clip(powers, -EXACT_POWER, EXACT_POWER))
    np.negative(values, out=values, where=negative)
    malformed = []
    for number in np.flatnonzero(odd).tolist():
        value = _parse(text[starts[number] : ends[number]].tobytes())
        values[number] = np.nan if value is None else value
        if value is None:
            malformed.append(number)
    return values, np.array(malformed, np.int64)


def _exponents(text: Bytes, starts: Ints, ends: Ints) -> tuple[Ints, Ints, Flags]:
    """Return where each word's mantissa ends, its decimal exponent, and whether that is malformed."""
    marks = (text | 0x20) == ord("e")
    if not marks.any():
        return ends, np.zeros(1, np.int64), np.zeros(len(ends), np.bool_)
    stops = _positions(marks, starts, ends)
    sign = text[stops + 1]
    lengths = np.maximum(ends - stops - 1 - ((sign == ord("-")) | (sign == ord("+"))), 0)
    values, wrong = digits(text, ends, np.minimum(lengths, DIGITS))
    exponents = values.astype(np.int64)
    wrong |= (stops < ends) & ((lengths == 0) | (lengths > 4))
    return stops, np.where(sign == ord("-"), -exponents, exponents), wrong


def _positions(marks: Flags, starts: Ints, stops: Ints) -> Ints:
    """Return the position of the last mark in each word; its stop if it has none."""
    where = np.flatnonzero(marks)
    if len(where) == len(starts) and (where >= starts).all() and (where < stops).all():
        return where
    found = stops.copy()
    word = np.searchsorted(stops, where, "right")
    where, word = where[word < len(stops)], word[word < len(stops)]
    inside = where >= starts[word]
    found[word[inside]] = where[inside]
    return found


def _parse(word: bytes) -> float | None:
    """Return the value of any number; None if it is not one."""
    try:
        return float(word)
    except ValueError:
        word = word.lower()
        infinity = float("-inf" if word.startswith(b"-") else "inf")
        return float("nan") if NAN.match(word) else infinity if INFINITE.match(word) else None
