"""What a device or a user chooses about a scene's program, beside what the scene needs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..accel.kernels import BUILDER_NAMES, TREELESS, TREES, HitTests
from ..device.open import Device
from ..errors import UsageError, check_choice
from .records import PIXEL, PIXEL_WITH_DIRECT

#: Where rays leave a surface.
OFFSETS = {"bound": "offset/bound.cl", "ulp": "offset/ulp.cl", "fixed": "offset/fixed.cl"}
#: How paths are followed, and with how many lanes in waves.
PATHS, WAVE_LANES = ("lanes", "waves"), 8
#: Paths a work-item.
LANES = (1, 8, 16)


@dataclass(frozen=True)
class Choices:
    """lanes: see LANES; offset: see OFFSETS; direct_light: whether the film keeps it apart.

    paths: how they are followed: "lanes", each in its lane (kernels/path.cl), or "waves", many together edge by edge
    (kernels/wave.cl); None for waves where there are 8 lanes, as they need.
    layout: a name in TREES, or None for the one that fits the device and the scene. tree: False where every ray is to
    meet all that there is one by one, True for a tree even where there is little; None for what is faster.
    first_hits: whether beside the picture what rays meet first is asked for, as AOVs, by a denoiser or by a user: then
    rays are followed whatever the integrator does.
    Raises UsageError for what is unknown, or can't be chosen together.
    """

    lanes: int = 8
    layout: str | None = None
    builder: str | None = None
    tests: HitTests = HitTests()
    offset: str = "bound"
    direct_light: bool = False
    paths: str | None = None
    tree: bool | None = None
    first_hits: bool = False

    def __post_init__(self) -> None:
        known: dict[str, tuple[object, ...]] = {"layout": (None, *TREES), "builder": (None, *BUILDER_NAMES),
                                                "lanes": LANES, "paths": (None, *PATHS), "offset": tuple(OFFSETS),
                                                "tree": (None, True, False), "first_hits": (True, False)}
        for name, values in known.items():
            check_choice(name, getattr(self, name), values)
        if self.paths == "waves" and self.lanes != WAVE_LANES:
            raise UsageError(f"paths in waves need {WAVE_LANES} lanes, not {self.lanes}; leave out one of the choices")
        if self.tree is not None and self.layout is not None and self.tree == (self.layout in TREELESS):
            raise UsageError(f"the layout {self.layout} is {'no tree' if self.tree else 'a tree'}, and tree is "
                             f"{'on' if self.tree else 'off'}; leave out one of the choices")

    @property
    def waves(self) -> bool:
        """Whether paths are followed in waves."""
        return self.lanes == WAVE_LANES and self.paths != "lanes"

    @property
    def pixel(self) -> np.dtype[Any]:
        """The record of a pixel of the film."""
        return PIXEL_WITH_DIRECT if self.direct_light else PIXEL


def choices_on(device: Device, asked: Choices, lanes: int | None) -> Choices:
    """What was asked for, and for the rest what suits the device."""
    return replace(asked, lanes=lanes or device.lanes, paths=asked.paths or (None if device.packs else "lanes"))
