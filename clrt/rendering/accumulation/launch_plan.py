"""What all launches of an image have in common, and the size of the first one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from ...accel.methods import TREELESS
from ...scene.model import RenderSettings
from ..compile.camera_kernel import launch_record
from ..compile.compile_scene import CompiledScene
from ..compile.film_record import launch_type

#: Minimum number of tiles per launch.
FEWEST_TILES = 16
#: Samples of the first launch, before any has been timed: slow devices take a tenth of a second for twice as many.
FIRST_LAUNCH_SAMPLES = 1 << 10
#: Number of primitives whose brute-force intersection takes about as long as a BVH traversal.
QUICKLY_MET = 128


@dataclass(frozen=True)
class LaunchPlan:
    """What all launches of an image have in common. size: (width, height); max_depth: as the integrator counts it;
    planned_spp: see `block_bits`."""

    size: tuple[int, int]
    max_depth: int
    seed: int
    planned_spp: int | None = None

    @staticmethod
    def of(settings: RenderSettings, planned_spp: int | None) -> LaunchPlan:
        """Return the plan of an image with these settings."""
        depth = min(settings.max_depth, 2) if settings.integrator == "direct" else settings.max_depth
        return LaunchPlan(settings.size, depth, settings.seed, planned_spp)

    def record(self, compiled: CompiledScene) -> NDArray[Any]:
        """Return the LAUNCH record of a scene's image, without a range of pixels and samples."""
        launch = launch_record(compiled.camera, self.size, launch_type(compiled.features))
        launch["max_depth"], launch["seed"], launch["block_bits"] = (
            self.max_depth,
            self.seed,
            block_bits(self.planned_spp),
        )
        launch["clamp_direct"], launch["clamp_indirect"] = compiled.clamps
        return launch


def first_launch_samples(compiled: CompiledScene) -> int:
    """Return the samples of the first launch, before any has been timed: fewer if rays are intersected by brute
    force."""
    primitives = int(compiled.counts["triangles"][0] + compiled.counts["spheres"][0])
    slow = compiled.tree.name in TREELESS and primitives > QUICKLY_MET
    return FIRST_LAUNCH_SAMPLES * QUICKLY_MET // primitives if slow else FIRST_LAUNCH_SAMPLES


def block_bits(planned_spp: int | None) -> int:
    """Return log2 of the samples that a pixel takes from one block of its sampler's sequence
    (kernels/sampler/interface.cl).

    This is the smallest power of two that covers `planned_spp`; 32, i.e. unlimited, if the sample count is not known.
    """
    return 32 if planned_spp is None else (planned_spp - 1).bit_length()
