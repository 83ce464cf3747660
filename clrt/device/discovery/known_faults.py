"""Faults of drivers that others reported, by platform and version (known_faults.json).

They are hints for users whose device fails its check, compiles for long or renders wrong images; whether a device works
is what its check says.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files


@cache
def reported_faults() -> list[dict[str, str]]:
    """Return the table: `platform`, `fault`, `source`, and optionally the versions, `from` one on and `before` one."""
    table: list[dict[str, str]] = json.loads((files(__package__) / "known_faults.json").read_text("utf-8"))
    return table


def known_faults(platform: str, driver: str, table: Iterable[Mapping[str, str]] | None = None) -> tuple[str, ...]:
    """Return the faults of this platform and version of its driver, each with its source."""
    version = version_of(driver)
    return tuple(
        f"{each['fault']} ({each['source']})"
        for each in (reported_faults() if table is None else table)
        if each["platform"].lower() == platform.strip().lower()
        and version_of(each.get("from", "")) <= version
        and ("before" not in each or version < version_of(each["before"]))
    )


def version_of(text: str) -> tuple[int, ...]:
    """Return the numbers of the version that a text begins with, such as (3, 0) of 3.0-rc2."""
    match = re.match(r"\d+(?:\.\d+)*", text.strip())
    return tuple(map(int, match[0].split("."))) if match else ()
