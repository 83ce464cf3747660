"""Decimal digits of texts, parsed in array operations: eight at a time, as the bytes of a 64-bit word.

Method: D. Lemire, "Quickly parsing eight digits", 2018, and W. D. Clinger, "How to read floating point numbers
accurately", 1990.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Words = NDArray[np.uint64]

#: Most digits of a number that are parsed here, in three words of 8 bytes; thus the number of spaces around a text.
DIGITS, MARGIN = 19, 24
#: Integers below this, and powers of ten up to this one, are float64 values, so that one division rounds correctly.
EXACT_INTEGER, EXACT_POWER = 1 << 53, 22
POWERS = np.array([10**power for power in range(DIGITS + 1)], np.uint64)
FLOAT_POWERS = 10.0 ** np.arange(EXACT_POWER + 1)
#: The highest bit of each byte.
OTHERS = 0x8080808080808080
#: A word of zeros; the first and the third of four pairs of digits; and what weighs these and the others in the upper
#: half of a word.
ZEROS, ODD_PAIRS, WEIGHTS = 0x3030303030303030, 0x000000FF000000FF, (100 + (10**6 << 32), 1 + (10**4 << 32))


def padded(text: bytes) -> Bytes:
    """Return lines of text as a writable array, between MARGIN spaces; a missing last line break is added."""
    margin = b" " * MARGIN
    end = b"" if not text or text.endswith(b"\n") else b"\n"
    return np.frombuffer(bytearray(margin + text + end + margin), np.uint8)


def words_at(text: Bytes, places: Ints) -> Words:
    """Return the eight bytes from each place on, the first one in the lowest bits."""
    words: Words = np.ndarray((len(text) - 7,), "<u8", text, 0, (1,))
    return words[places]


def runs(mask: Flags) -> tuple[Ints, Ints]:
    """Return the starts and the ends of the runs of True; the first and the last element must be False."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    return edges[::2], edges[1::2]


def digits(text: Bytes, ends: Ints, lengths: Ints) -> tuple[Words, Flags]:
    """Parse runs of at most DIGITS decimal digits: their values, and which of them contain other bytes."""
    values, strange = np.zeros(len(ends), np.uint64), np.zeros(len(ends), np.uint64)
    longest = int(lengths.max(initial=0))
    for done in range(0, min(longest, DIGITS), 8):
        word = last_digits(text, ends - done, lengths if longest <= 8 else np.clip(lengths - done, 0, 8))
        strange |= with_other_bytes(word)
        word = eight_digits(word)
        values += word * POWERS[done] if done else word
    return values, strange & OTHERS != 0


def last_digits(text: Bytes, ends: Ints, lengths: Ints) -> Words:
    """Return the values of up to eight digits that end there, one per byte, the last one in the highest; other bytes of
    the text become numbers above nine."""
    word = words_at(text, ends - 8)
    word ^= ZEROS
    return last_bytes(word, lengths)


def last_bytes(word: Words, lengths: Ints) -> Words:
    """Set all but the highest bytes, as many as `lengths` says, to 0, in the same array."""
    unwanted = (64 - 8 * lengths).view(np.uint64)
    word >>= unwanted
    word <<= unwanted
    return word


def with_other_bytes(word: Words) -> Words:
    """Return words with bits of OTHERS for bytes above nine."""
    return (word + 0x7676767676767676) | word


def eight_digits(word: Words) -> Words:
    """Return the numbers whose digits `last_digits` returned, in the same array: joins digits, then all four pairs."""
    pairs = word >> 8
    word *= 10
    word += pairs
    np.right_shift(word, 16, out=pairs)
    for each, weight in zip((word, pairs), WEIGHTS):
        each &= ODD_PAIRS
        each *= weight
    word += pairs
    word >>= 32
    return word


def scaled(mantissas: Words, powers: Ints) -> Floats:
    """Return mantissas times powers of ten, of −EXACT_POWER to EXACT_POWER."""
    values, down = mantissas.astype(np.float64), powers <= 0
    factors = FLOAT_POWERS[abs(powers)]
    scaled = values / factors if down.all() else np.where(down, values / factors, values * factors)
    if (long := np.flatnonzero(mantissas >= EXACT_INTEGER)).size:
        precise, factor = mantissas[long].astype(np.longdouble), factors[long]
        scaled[long] = np.where(down[long], precise / factor, precise * factor)
    return scaled
