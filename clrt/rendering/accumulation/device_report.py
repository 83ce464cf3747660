"""Device section of a report: what rendered an image, and what was built for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...device.open import Device
from ..compile.compile_scene import CompiledScene
from .accumulation import Accumulation


def machine_report(devices: Sequence[Device], picture: Accumulation) -> dict[str, Any]:
    """Return the report's fields on the devices that were to render an image, their programs, BVHs and memory."""
    infos = [device.info for device in devices]
    return {
        "platform": " + ".join(dict.fromkeys(info.platform for info in infos)),
        "driver": " + ".join(dict.fromkeys(info.driver for info in infos)),
        "bvh": tree_report(picture.compiled),
        "kernel": {
            "build_seconds": picture.build_seconds,
            "cached": picture.cached,
            "features": picture.compiled.features,
            "longest_launch_seconds": picture.longest_launch,
        },
        "peak_device_bytes": picture.device_bytes,
        **({"devices": picture.shares()} if len(infos) > 1 else {}),
    }


def tree_report(compiled: CompiledScene) -> dict[str, Any]:
    """Return the report's BVH section."""
    tree, counts = compiled.tree, compiled.counts[0]
    return {
        "triangles": int(counts["triangles"]),
        "spheres": int(counts["spheres"]),
        "instances": compiled.instances,
        "nodes": tree.nodes,
        "bytes": tree.bytes,
        "build_seconds": tree.build_seconds,
        "sah_cost": tree.sah_cost,
        "layout": tree.name,
        "builder": tree.builder,
        "depth": tree.depth,
    }
