"""Formatting of values as TOML."""

from __future__ import annotations

import json
import re
from datetime import datetime
from typing import Any


def is_plain(value: object) -> bool:
    """Return whether the value has a TOML representation."""
    return isinstance(value, bool | int | float | str | tuple | datetime)


def toml_value(value: Any) -> str:
    """Format a value; numbers round-trip exactly."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{toml_key(name)} = {toml_value(each)}' for name, each in value.items())} }}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, datetime):
        return value.isoformat()
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else repr(value)


def toml_key(name: str) -> str:
    """Format a key, quoted if necessary."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_value(name)
