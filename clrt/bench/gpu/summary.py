"""One line about each part of the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .parts import PARTS
from .request import Row


def summary_line(name: str, part: Mapping[str, Any]) -> str:
    """Return the part's title, its main result, and what failed."""
    rows = measured(part)
    told = [MAIN[name](rows)] if rows and name in MAIN else []
    for key, text in (("error", "failed"), ("skipped", "not supported")):
        if count := sum(key in row for row in part["rows"].values()):
            told.append(f"{count} {text}")
    if part["state"] != "done":
        told.append(part.get("failure") or "to be completed")
    return f"{PARTS[name].title}: {'; '.join(told) or 'nothing measured'} ({part['seconds']:.0f} s)"


def measured(part: Mapping[str, Any]) -> dict[str, Row]:
    """Return the rows with figures by item."""
    return {item: row for item, row in part["rows"].items() if not {"error", "skipped"} & {*row}}


def _device(rows: Mapping[str, Row]) -> str:
    check = rows.get("check")
    return "not checked" if check is None else "check passed" if check["passed"] else f"FAILED: {check['failures']}"


def _hits(rows: Mapping[str, Row]) -> str:
    return f"{_sum(rows, 'differ')} of {_sum(rows, 'rays')} rays' hits differ in any configuration"


def _images(rows: Mapping[str, Row]) -> str:
    ratios = [abs(row["ratio"] - 1) for row in rows.values() if row.get("ratio") is not None]
    return f"means of {len(ratios)} images differ by at most {max(ratios):.2g}" if ratios else "no other device"


def _most(key: str, text: str) -> Callable[[Mapping[str, Row]], str]:
    def told(rows: Mapping[str, Row]) -> str:
        item, row = max(rows.items(), key=lambda each: each[1].get(key) or 0)
        return f"{text} {row[key]:.4g} ({item})"

    return told


def _frames(rows: Mapping[str, Row]) -> str:
    return ", ".join(
        f"{name}: {next(iter(row['rows'].values()))['frames_per_second']:.4g} frames/s" for name, row in rows.items()
    )


def _sum(rows: Mapping[str, Row], key: str) -> int:
    return sum(each for each in _values(rows, key))


def _values(rows: Mapping[str, Row], key: str) -> Iterable[Any]:
    return (row[key] for row in rows.values() if row.get(key) is not None)


MAIN: dict[str, Callable[[Mapping[str, Row]], str]] = {
    "device": _device,
    "hits": _hits,
    "images": _images,
    "rays": _most("mrays", "most Mrays/s:"),
    "samples": _most("msamples", "most Msamples/s:"),
    "groups": _most("mrays", "most Mrays/s:"),
    "builds": _most("mtriangles", "most Mtriangles/s:"),
    "frames": _frames,
    "calls": lambda rows: f"shortest call {min(_values(rows, 'call_seconds')):.2g} s",
    "compiles": lambda rows: (
        f"at most {max(_values(rows, 'cold_seconds')):.2g} s cold, {max(_values(rows, 'warm_seconds')):.2g} s warm"
    ),
}
