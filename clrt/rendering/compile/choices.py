"""How an image is computed, in addition to what the scene requires: choices of a device or a user."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

from ...accel.methods import TREELESS, BuilderName, HitTests, LayoutName
from ...device.device_info import Paths
from ...errors import UsageError
from ...option_fields import check_values, option

if TYPE_CHECKING:
    from ...device.open import Device

Lanes = Literal[1, 8, 16]
Offset = Literal["bound", "ulp", "fixed"]
Guiding = Literal["off", "on"]
#: SIMD widths: paths per work-item; and the one that the wavefront needs.
LANES, WAVE_LANES = get_args(Lanes), 8
#: The SIMD width that an execution of paths needs.
NEEDED_LANES = {"waves": WAVE_LANES, "queues": 1}
#: Kernel files of the methods to offset ray origins from surfaces.
OFFSETS = {name: f"offset/{name}.cl" for name in get_args(Offset)}


@dataclass(frozen=True)
class Choices:
    """How an image is computed; what is None suits the device (see `on`) or the scene.

    direct_light, light_groups: whether the film stores it, or the light of each group, separately. Raises UsageError
    for unknown values and for options that exclude each other.
    """

    lanes: int | None = option(None, "SIMD width: paths per work-item.", LANES)
    layout: str | None = option(None, "BVH layout; packs (for small scenes) and list use no BVH.", get_args(LayoutName))
    builder: str | None = option(
        None, "BVH builder; default: sah for small scenes, ploc on the device for large ones.", get_args(BuilderName)
    )
    tests: HitTests = HitTests()
    offset: str = option(
        "bound", "Offset of ray origins from the surface: its rounding error bound, a few ulps, or 0.001.", OFFSETS
    )
    direct_light: bool = False
    light_groups: bool = False
    paths: str | None = option(
        None,
        "lanes: megakernel; waves: wavefront in each work-item (needs 8 lanes); queues: wavefront with a kernel per "
        "stage (needs 1 lane). Default: by device.",
        get_args(Paths),
    )
    tree: bool | None = option(
        None, "Use a BVH, or intersect every ray with all primitives (brute force); default: the faster.", (True, False)
    )
    guiding: str = option(
        "off", "Learn first where light comes from, and send paths there, too (docs/guiding.md).", get_args(Guiding)
    )
    first_hits: bool = option(
        False,
        "Whether first hits will be requested later, as AOVs, by a denoiser or by a user: then rays are traced "
        "whatever the integrator does.",
        (True, False),
    )

    def __post_init__(self) -> None:
        check_values(self)
        needed = NEEDED_LANES.get(self.paths or "")
        if needed is not None and self.lanes not in (None, needed):
            raise UsageError(
                f"paths = {self.paths} needs {needed} lane{'s' * (needed > 1)}, not {self.lanes}; leave out one of them"
            )
        if self.tree is not None and self.layout is not None and self.tree == (self.layout in TREELESS):
            raise UsageError(
                f"the layout {self.layout} is {'not ' * self.tree}a BVH, and tree is "
                f"{'on' if self.tree else 'off'}; leave out one of them"
            )

    def on(self, device: Device | None) -> ResolvedChoices:
        """Return the choices with SIMD width and paths as they suit the device; without one, as they suit a CPU.

        Raises UsageError if the device's SIMD width excludes the chosen paths.
        """
        lanes = self.lanes or (1 if self.paths == "queues" else device.lanes if device else WAVE_LANES)
        return ResolvedChoices(**{**vars(self), "lanes": lanes, "paths": self.paths or _paths_on(device, lanes)})


def _paths_on(device: Device | None, lanes: int) -> Paths:
    """Return the execution of paths for this SIMD width: the measured one, else the one expected to be fastest."""
    tuning = device.info.tuning if device else None
    if tuning and NEEDED_LANES.get(tuning.paths, lanes) == lanes:
        return tuning.paths
    if lanes == WAVE_LANES and (device is None or device.packs):
        return "waves"
    return "queues" if lanes == 1 and device is not None and device.info.type == "gpu" else "lanes"


@dataclass(frozen=True)
class ResolvedChoices(Choices):
    """Choices on one device: only layout, builder and tree may be open, which depend on the scene, too."""

    lanes: int = WAVE_LANES
    paths: str = "waves"
