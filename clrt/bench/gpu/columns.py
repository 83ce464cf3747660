"""Columns of the tables of each part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from .request import Row


class Column(NamedTuple):
    """Column of a table. key: of the row; form: format of its numbers; factor: to multiply them by."""

    title: str
    key: str
    form: str = ""
    factor: float = 1.0

    def text(self, row: Mapping[str, Any]) -> str:
        """Return the row's cell, empty if it has none."""
        value = row.get(self.key)
        if value is None:
            return ""
        if isinstance(value, bool) or not isinstance(value, int | float):
            return {True: "yes", False: "NO"}.get(value, str(value)) if isinstance(value, bool) else str(value)
        return format(value * self.factor if self.factor != 1 else value, self.form)


MRAYS, LONGEST = Column("Mrays/s", "mrays", ".4g"), Column("longest launch, ms", "longest_launch", ".3g", 1e3)
MSAMPLES = Column("Msamples/s", "msamples", ".4g")
COLUMNS = {
    "hits": [
        Column("triangles", "triangles", ","),
        Column("rays", "rays", ","),
        Column("configurations", "configurations"),
        Column("hits that differ", "differ"),
        Column("impossible in float64", "wrong"),
        Column("rays that escape", "escaped"),
        Column("as stored", "stored"),
        Column("failures", "failures"),
    ],
    "images": [
        Column("finite", "finite"),
        Column("mean", "mean", ".6g"),
        Column("ratio of means", "ratio", ".7f"),
        Column("pixels equal", "equal", ".4f"),
        Column("within 0.1 %", "near", ".4f"),
        Column("mean over the reference's", "reference_ratio", ".4f"),
        Column("programs", "programs"),
        Column("compiled in s", "program_seconds", ".2f"),
    ],
    "rays": [
        Column("builder", "builder"),
        Column("stack", "stack"),
        Column("rays", "rays", ","),
        Column("hits", "hits", ".0%"),
        MRAYS,
        Column("in calls", "mrays_call", ".4g"),
        LONGEST,
    ],
    "samples": [
        Column("kernel", "kernel"),
        Column("layout", "layout"),
        Column("triangles", "triangles", ","),
        MSAMPLES,
        MRAYS,
        LONGEST,
        Column("ready in s", "ready_seconds", ".2f"),
        Column("of it program", "program_seconds", ".2f"),
        Column("mean", "mean", ".5g"),
    ],
    "groups": [MRAYS, MSAMPLES, LONGEST],
    "builds": [
        Column("seconds", "seconds", ".4g"),
        Column("first call", "first_seconds", ".4g"),
        Column("Mtriangles/s", "mtriangles", ".4g"),
        Column("of it upload", "upload_seconds", ".4g"),
        Column("Mtriangles/s without", "mtriangles_uploaded", ".4g"),
        Column("SAH cost", "sah_cost", ".2f"),
        Column("B/triangle", "bytes_per_triangle", ".1f"),
        Column("peak B/triangle", "peak_bytes_per_triangle", ".1f"),
    ],
    "frames": [
        Column("size", "size"),
        Column("triangles", "triangles", ","),
        Column("ms/frame", "seconds", ".4g", 1e3),
        Column("frames/s", "frames_per_second", ".4g"),
        Column("frames", "frames"),
        Column("theirs, ms", "theirs", ".4g", 1e3),
        Column("on", "machine"),
    ],
    "calls": [Column("call, ms", "call_seconds", ".4g", 1e3), Column("kernel, ms", "kernel_seconds", ".4g", 1e3)],
    "compiles": [
        Column("characters", "characters", ","),
        Column("cold, s", "cold_seconds", ".2f"),
        Column("warm, s", "warm_seconds", ".2f"),
        Column("registers", "registers"),
        Column("spilled bytes", "spill_store_bytes"),
        Column("stack bytes", "stack_bytes"),
        Column("private bytes", "private_bytes"),
        Column("local bytes", "local_bytes"),
        Column("largest group", "largest_group"),
        Column("groups of", "group_multiple"),
    ],
    "peers": [
        Column("on", "on"),
        Column("rays", "rays", ","),
        Column("clrt, Mrays/s", "clrt_mrays", ".4g"),
        Column("Warp, Mrays/s", "warp_mrays", ".4g"),
        Column("clrt, Msamples/s", "clrt_msamples", ".4g"),
        Column("Mitsuba, Msamples/s", "mitsuba_msamples", ".4g"),
        Column("mean", "mean", ".5g"),
    ],
}


def rows_of(part: Mapping[str, Any]) -> dict[str, Row]:
    """Return the rows of a part's table: an item that has `rows` of its own has one for each, with what they share."""
    rows: dict[str, Row] = {}
    for item, row in part["rows"].items():
        own = row.get("rows") or {}
        shared = {key: value for key, value in row.items() if key != "rows"}
        rows |= {f"{item}: {name}": {**shared, **figures} for name, figures in own.items()} or {item: shared}
    return rows
