"""Scene compilation: from a scene to the buffers and program text that a device needs to render it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.layouts import Layout
from ...device.launches.driver_loop_limits import loop_turns
from ...device.memory_plan import array_bytes, needed_parts
from ...device.open import Device
from ...device.programs.preamble import Buffers
from ...device.programs.program import compose, files_of
from ...scene.geometry.scaling import SceneFrame, camera_in
from ...scene.model import Camera, Scene
from ...scene.validation.validate import validate
from ..film.tiles import TILE_PIXELS
from .camera_kernel import camera_buffers
from .choices import Choices, ResolvedChoices
from .compile_ahead import begin_program
from .features import WITH_LIGHT, features_of, files_for, launch_typedef, preamble_of
from .film_record import pixel_record
from .geometry.pack_instances import ObjectIds
from .pack_scene import pack_scene
from .reuse_cache import ReuseCache

MEGAKERNEL, WAVEFRONT, QUEUES = "integrator/megakernel.cl", "integrator/wavefront.cl", "integrator/queues.cl"
RASTER, DEBUG = "integrator/raster.cl", "integrator/debug.cl"
#: Names of the kernels that render, by file; the first of several.
KERNELS = {MEGAKERNEL: "megakernel", WAVEFRONT: "wavefront", QUEUES: "generate", RASTER: "raster", DEBUG: "debug"}
#: Files of path tracing by `Choices.paths`.
PATHS = {"lanes": MEGAKERNEL, "waves": WAVEFRONT, "queues": QUEUES}


@dataclass(frozen=True)
class CompiledScene:
    """Buffers and program of a scene, ready for a device. The order of the buffers is that of the kernel's arguments.

    All points, including the camera's, are in the coordinates of `frame` (see scene.scaling). instances: the number of
    instances in the BVH; others became meshes (see scene.instancing). part_bytes: maximum size of the parts into which
    the arrays are split, as the device has no larger buffers (kernels/core/arrays.cl). groups: the light groups that
    the film stores. clamps: of direct and of
    indirect light, infinite for none.
    """

    buffers: Buffers
    counts: NDArray[Any]
    features: list[str]
    preamble: str
    chosen_files: dict[str, list[str]]
    entry: str
    tree: Layout
    choices: ResolvedChoices
    camera: Camera
    frame: SceneFrame
    instances: int
    objects: ObjectIds
    part_bytes: int | None = None
    groups: tuple[str, ...] = ()
    clamps: tuple[float, float] = (inf, inf)

    @cached_property
    def source(self) -> str:
        """Text of the program."""
        return self.source_of(self.entry)

    def source_of(self, entry: str, *preamble: str, **files: list[str]) -> str:
        """Return the program text of the same scene with another kernel file as its entry.

        preamble, files: what this entry needs in addition: definitions before it, and files for its own `#include
        NAME`.
        """
        return compose("\n".join([self.preamble, *preamble]), entry, {**self.chosen_files, **files})

    def seen_by(self, camera: Camera, file: str) -> CompiledScene:
        """Return the same scene with another camera, whose kernel file is `file` (see `camera_file`)."""
        camera = camera_in(camera, self.frame)
        own, other = (launch_typedef(each, self.features) for each in (self.camera, camera))
        return replace(
            self,
            camera=camera,
            buffers={**self.buffers, **camera_buffers(camera)},
            preamble=self.preamble.replace(own, other),
            chosen_files={**self.chosen_files, "CAMERA": [file]},
        )

    def has_text_of(self, other: CompiledScene) -> bool:
        """Return whether both have the same program, with arrays split into the same parts."""
        return all(
            getattr(self, name) == getattr(other, name) for name in ("preamble", "chosen_files", "entry", "part_bytes")
        )

    @property
    def kernel(self) -> str:
        """Name of the entry's kernel."""
        return KERNELS[self.entry]

    @property
    def pixels(self) -> int:
        """Pixels per work-item of the entry's kernel."""
        whole = self.entry == WAVEFRONT or (self.entry == RASTER and self.choices.lanes > 1)
        return TILE_PIXELS if whole else self.choices.lanes

    @property
    def pixel(self) -> np.dtype[Any]:
        """Record type of a film pixel."""
        return pixel_record(self.features, len(self.groups))

    @property
    def files(self) -> list[str]:
        """Kernel files that the program consists of."""
        return files_of(self.source)

    @property
    def bytes(self) -> int:
        """Device memory of the scene in bytes."""
        return sum(array_bytes(array, self.part_bytes) for _, array in self.buffers.values())


def compile_scene(
    scene: Scene,
    choices: Choices,
    entry: str | None = None,
    device: Device | None = None,
    carried: ReuseCache | None = None,
    ahead: bool = False,
) -> CompiledScene:
    """Validate and pack `scene` for the kernel file `entry`. Raises SceneError listing everything that is wrong with
    it.

    entry: None for the scene's integrator; device: where large BVHs are built, and which open choices suit, if given;
    carried: results that can be reused from the previous scene; ahead: whether its program will be built on the device.
    """
    validate(scene)
    choices = choices.on(device)
    if ahead and device is not None:
        begin_program(scene, choices, device, lambda scene, choices: compile_scene(scene, choices).source)
    packed = pack_scene(scene, choices, device, carried or ReuseCache())
    features = features_of(packed, choices, device is not None and loop_turns(device) is not None)
    part_bytes = needed_parts((array for _, array in packed.buffers.values()), device.info) if device else None
    if entry is None:
        entry = _entry(scene.render.integrator, choices, features)
    return CompiledScene(
        packed.buffers,
        packed.counts,
        sorted(features),
        preamble_of(packed, choices, features, part_bytes),
        files_for(packed, choices, features),
        entry,
        packed.tree,
        choices,
        packed.scene.camera,
        packed.frame,
        len(packed.scene.instances),
        packed.shapes.objects,
        part_bytes,
        packed.groups,
        (scene.render.clamp_direct or inf, scene.render.clamp_indirect or inf),
    )


def _entry(integrator: str, choices: ResolvedChoices, features: set[str]) -> str:
    """Return the kernel file of an integrator."""
    if integrator == "raster":
        return RASTER
    entry = PATHS[choices.paths] if integrator in WITH_LIGHT else MEGAKERNEL
    return MEGAKERNEL if entry == WAVEFRONT and "LOOP_LIMIT" in features else entry
