"""Program options that a device or a user chooses, in addition to what the scene requires."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...accel.traversal_kernels import BUILDER_NAMES, TREELESS, TREES, HitTests
from ...device.open import Device
from ...errors import UsageError, check_choice
from .records import PIXEL, PIXEL_WITH_DIRECT

#: Kernel files of the methods to offset ray origins from surfaces.
OFFSETS = {"bound": "offset/bound.cl", "ulp": "offset/ulp.cl", "fixed": "offset/fixed.cl"}
#: Path modes ("lanes" is the megakernel, "waves" the wavefront), and the SIMD width that the wavefront needs.
PATHS, WAVE_LANES = ("lanes", "waves"), 8
#: SIMD widths: paths per work-item.
LANES = (1, 8, 16)


@dataclass(frozen=True)
class Choices:
    """Program options. lanes: see LANES; offset: see OFFSETS; direct_light: whether the film stores it separately.

    paths: "lanes" for the megakernel, one path per lane (kernels/integrator/path.cl), or "waves" for the wavefront,
    which advances many paths together by one vertex at a time (kernels/integrator/wavefront.cl); None for the wavefront
    if there are 8 lanes, as it needs. layout: a name in TREES, or None for the one that fits the device and the scene.
    tree: False for brute force (no BVH), True for a BVH even for few primitives; None for the faster one. first_hits:
    whether first hits are requested along with the image, as AOVs, by a denoiser or by a user: then rays are traced
    whatever the integrator does. Raises UsageError for unknown values and for options that exclude each other.
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
            raise UsageError(f"paths = waves needs {WAVE_LANES} lanes, not {self.lanes}; leave out one of them")
        if self.tree is not None and self.layout is not None and self.tree == (self.layout in TREELESS):
            raise UsageError(f"the layout {self.layout} is {'not ' * self.tree}a BVH, and tree is "
                             f"{'on' if self.tree else 'off'}; leave out one of them")

    @property
    def waves(self) -> bool:
        """Whether paths are traced in wavefront mode."""
        return self.lanes == WAVE_LANES and self.paths != "lanes"

    @property
    def pixel(self) -> np.dtype[Any]:
        """Record type of a film pixel."""
        return PIXEL_WITH_DIRECT if self.direct_light else PIXEL


def choices_on(device: Device, asked: Choices, lanes: int | None) -> Choices:
    """Return the requested options, with the device's preferences for those left open."""
    return replace(asked, lanes=lanes or device.lanes, paths=asked.paths or (None if device.packs else "lanes"))
