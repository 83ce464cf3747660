"""Executions of paths in the order in which to measure them."""

from __future__ import annotations

from typing import get_args

from ...device.device_info import Paths
from ...device.open import open_device
from ...rendering.compile.choices import Choices


def executions(selector: str) -> list[Paths]:
    """Return the device's own choice of `Paths`, then the others, some of which it may not support."""
    own = Choices().on(open_device(selector)).paths
    return sorted(get_args(Paths), key=lambda paths: bool(paths != own))
