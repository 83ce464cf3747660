"""JSON that programs in any language can parse."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..file_names import printable


def json_text(value: Any, *, indent: int | None = None, ascii_only: bool = True) -> str:
    """Return `value` as JSON: numpy's numbers and arrays as Python's, paths as strings, file names through `printable`,
    and null for NaN and Inf, which JSON lacks."""
    return json.dumps(_plain(value), indent=indent, ensure_ascii=ascii_only, allow_nan=False)


def _plain(value: Any) -> Any:
    """Return the same value in JSON's types."""
    match value:
        case str() | Path():
            return printable(str(value))
        case Mapping():
            return {printable(str(key)): _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case np.ndarray() | np.generic():
            return _plain(value.tolist())
        case float():
            return value if math.isfinite(value) else None
    return value
