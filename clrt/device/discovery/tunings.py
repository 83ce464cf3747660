"""Tunings of devices (bench/tuning/tune.py), cached with the compiled programs."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import get_args

from ..device_info import DeviceInfo, Paths, TunedLayout, Tuning
from .kept_results import keep_result, kept_result

#: Suffix of the files.
KIND = "tuning.json"
LARGEST_GROUP = 1024


def keep_tuning(info: DeviceInfo, tuning: Tuning) -> bool:
    """Store the tuning of a device; return False if that is not possible."""
    return keep_result(info, KIND, asdict(tuning))


def kept_tuning(info: DeviceInfo) -> Tuning | None:
    """Return the stored tuning of a device in its present state, or None."""
    kept = kept_result(info, KIND)
    if set(kept) != {field.name for field in fields(Tuning)}:
        return None
    named = kept["paths"] in get_args(Paths) and kept["layout"] in get_args(TunedLayout)
    sized = isinstance(kept["group_size"], int) and 1 <= kept["group_size"] <= LARGEST_GROUP
    return Tuning(**kept) if named and sized else None
