"""Numbers in text files."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray


def numbers_in(text: bytes) -> NDArray[np.float64]:
    """Parse numbers between white space, also nan and inf; raises ValueError for any other word."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "string or file could not be read")  # which older versions of numpy emit
        try:
            return np.fromstring(text, np.float64, sep=" ")
        except DeprecationWarning as warning:
            raise ValueError(str(warning)) from None
