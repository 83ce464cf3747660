"""Training of a guiding field: passes of paths, each guided by the field that was learned from the one before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...device.open import Device
from ..accumulation.launch_plan import LaunchPlan
from ..accumulation.single_device import SingleDeviceAccumulation
from ..compile.compile_scene import CompiledScene
from ..compile.guiding_field import UNTRAINED
from .learned_field import learned_field
from .recorded_paths import record_paths


class Training(NamedTuple):
    """passes: paths per pixel of each pass; pixels: number of pixels of their image."""

    passes: tuple[int, ...] = (1, 2, 4, 8, 16, 32)
    pixels: int = 256 * 144


#: Added to an image's seed: learned from the image's own samples, a field would favor them, and bias it.
OTHER_SEED = 0x9E3779B9
#: The training of a render.
FULL = Training()


def guided(
    devices: Sequence[Device], compiled: Sequence[CompiledScene], plan: LaunchPlan, how: Training | None = None
) -> list[CompiledScene]:
    """Return the scenes with the field learned for the planned image, the same for all devices.

    It is trained on the first one, by paths that depend on the plan alone: an image is the same however its work is
    divided. Scenes without guiding are returned as they are. Raises DeviceError and KernelError if the device fails.
    """
    if "GUIDING" not in compiled[0].features:
        return list(compiled)
    field, session, first = UNTRAINED, None, 0
    passes, pixels = how or FULL
    for count in passes:
        scene = replace(compiled[0], buffers={**compiled[0].buffers, **field}, clamps=(np.inf, np.inf))
        session = SingleDeviceAccumulation(
            devices[0], scene, _training_plan(plan, pixels), session.scenes if session else ()
        )
        paths = [record_paths(session, sample) for sample in range(first, first + count)]
        field, first = learned_field(np.concatenate(paths)), first + count
    return [replace(scene, buffers={**scene.buffers, **field}) for scene in compiled]


def _training_plan(plan: LaunchPlan, pixels: int) -> LaunchPlan:
    width, height = plan.size
    scale = (pixels / (width * height)) ** 0.5
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return replace(plan, size=size, seed=(plan.seed + OTHER_SEED) % (1 << 32), planned_spp=None)
