"""Values as TOML writes them."""

from __future__ import annotations

import json
import re
from typing import Any


def is_plain(value: object) -> bool:
    """Whether TOML has such values."""
    return isinstance(value, bool | int | float | str | tuple)


def toml_value(value: Any) -> str:
    """A value; numbers to the last digit."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{toml_key(name)} = {toml_value(each)}' for name, each in value.items())} }}"
    if isinstance(value, bool):
        return str(value).lower()
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else repr(value)


def toml_key(name: str) -> str:
    """A key, in quotes where it needs them."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_value(name)
