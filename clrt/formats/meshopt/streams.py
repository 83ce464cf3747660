"""Errors of compressed streams, and how large what they decode to may be."""

from __future__ import annotations

#: Decoded bytes that any stream may have, and at most per byte of a larger one.
FREE_BYTES = 2**26
MOST_RATIO = 64


class StreamError(ValueError):
    """A stream is damaged; the message says how."""


ENDS_EARLY = "it ends too early"


def check_size(stored: int, decoded: int) -> None:
    """Raise StreamError if a stream of `stored` bytes cannot hold so many bytes, so that it would cost memory only."""
    if decoded > max(FREE_BYTES, MOST_RATIO * stored):
        raise StreamError(f"its {stored} bytes cannot contain {decoded} bytes")
