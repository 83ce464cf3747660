"""Hits of the same rays on the device and on another one, by every BVH layout, builder and traversal: equal bits.

Without another device, they are compared with digests of PoCL's hits, which come with clrt.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import partial
from importlib.resources import files
from typing import Any

from ...device.discovery.discover import choose
from ..numerics.hit_agreement import Case, Effort, cases, measure_case
from .request import Item, Request, Row

EFFORT, QUICK = Effort(1 << 15, 5, 1000, 1 << 25, 1 << 26), Effort(1 << 6, 1, 50, 1 << 15, 1 << 15)


def items(request: Request) -> Iterator[Item]:
    """Yield the meshes."""
    effort = QUICK if request.quick else EFFORT
    indices = [choose(each)[0].index for each in (request.other, request.device) if each is not None]
    for case in cases(effort):
        yield Item(case.name, partial(_measure, case, indices, effort))


def _measure(case: Case, indices: list[int], effort: Effort) -> Row:
    return summary(measure_case(case, indices, effort), known_digests())


def known_digests() -> dict[str, str]:
    """Return the digests of PoCL's hits by that of their rays."""
    known: dict[str, str] = json.loads((files(__package__) / "known_hits.json").read_text("utf-8"))
    return known


def summary(result: Mapping[str, Any], known: Mapping[str, str]) -> Row:
    """Return a row from a result of `measure_case`.

    differ: hits that are not bitwise equal, of all configurations; stored: whether the hits are those of `known`, None
    if that has none of these rays, as a machine's numpy may have other sines than that of the digests' machine.
    """
    errors = [way["error"] for way in result["ways"] if "error" in way]
    digests = result.get("digests", {})
    expected = known.get(digests.get("rays", ""))
    return {
        "triangles": result["triangles"],
        "rays": result["rays"],
        "configurations": len(result["ways"]) - len(errors),
        "differ": sum(sum(way["differ"].values()) for way in result["ways"] if "differ" in way),
        "wrong": result["exact"]["wrong"] if "exact" in result else None,
        "escaped": result.get("escaped"),
        "stored": digests["hits"] == expected if expected else None,
        "failures": "; ".join(errors),
        "digests": digests,
    }
