"""Maximum size of a buffer: the device's, or a lower one, to test arrays that are split into parts."""

from __future__ import annotations

import os
import re

from ..errors import UsageError

#: For developers: an upper bound on a device's largest buffer, such as 1M.
VARIABLE = "CLRT_MAX_ALLOC"
UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def largest_buffer(allowed: int) -> int:
    """Return the device's limit, or that of VARIABLE if it is lower."""
    asked = os.environ.get(VARIABLE)
    if not asked:
        return allowed
    if not (match := re.fullmatch(r"([1-9]\d*)([KMG]?)", asked)):
        raise UsageError(f"{VARIABLE} is {asked!r}; it must be a number of bytes, like 65536, 512K, 64M or 1G")
    return min(allowed, int(match[1]) * UNITS[match[2]])
