"""Write what a render measured, as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .files import check_target, replacing


def write_report(path: Path, report: Mapping[str, Any]) -> Path:
    """Write `report` in one step (see `replacing`); NaN and Inf, which JSON lacks, become null. Returns `path`.

    Raises OutputError.
    """
    check_target(path)
    text = json.dumps(_plain(report), indent=1, ensure_ascii=False, allow_nan=False)
    with replacing(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def _plain(value: Any) -> Any:
    """The same value in JSON's types: numpy's numbers and arrays as Python's, paths as text."""
    match value:
        case Mapping():
            return {str(key): _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case np.ndarray() | np.generic():
            return _plain(value.tolist())
        case float():
            return value if math.isfinite(value) else None
        case Path():
            return str(value)
    return value
