"""What is tried on a device, the expected best first."""

from __future__ import annotations

from ...device.device_info import Tuning
from ...device.open import Device

#: Work-group sizes of the queues' kernels.
GROUP_SIZES = (128, 64, 256)


def candidates(device: Device) -> list[Tuning]:
    """Return the candidates: executions of paths and BVH layouts and, for queues, work-group sizes."""
    if device.vectors:
        return [Tuning(paths, "bvh8", 1) for paths in ("waves", "lanes")] + [Tuning("lanes", "bvh2", 1)]
    queues = [Tuning("queues", "cwbvh", size) for size in GROUP_SIZES] + [Tuning("queues", "bvh2", GROUP_SIZES[0])]
    return queues + [Tuning("lanes", layout, GROUP_SIZES[0]) for layout in ("cwbvh", "bvh2")]
