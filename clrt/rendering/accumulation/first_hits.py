"""First-hit AOVs: what each pixel's camera rays hit first (kernels/aov/first_hit.cl)."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...aov_types import AOV_TYPES, aovs_from
from ...device.programs.preamble import typedefs
from ...device.programs.struct_types import record
from ...scene.cryptomatte import NAMES, RANKS, ids_of
from ...scene.exposure import camera_at, middle_of_rows
from ...scene.model import Camera, Scene
from ...scene.numbered_objects import materials_of, numbers_of
from ..compile.compile_scene import CompiledScene
from .accumulation import Accumulation
from .per_pixel_kernel import PerPixelKernel, per_pixel_kernel, render_pixels

#: Maximum number of camera rays per pixel.
SAMPLES = 16


def first_hits(session: Accumulation, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
    """Return the AOVs of first hits in `names`, for the scene that the session renders.

    As in docs/aovs.md: (height, width, 3) float32, (height, width) with one channel, and ids (height, width) int32.
    Raises KernelError and DeviceError if the device fails.
    """
    means, centers = _seen(names)
    seen = render_pixels(session, _kernel(session, names), _samples(session) if means else 0)
    pictures: dict[str, NDArray[np.generic]] = {
        name: np.ascontiguousarray(seen[name] if len(AOV_TYPES[name].channels) == 3 else seen[name][..., 0])
        for name in means + centers
    }
    missed = seen["primitive"] < 0
    if "position" in centers:
        place = seen["position"].astype(np.float64)
        if "position" in names:
            pictures["position"] = _positions(session, place, missed)
        if "depth" in names:
            pictures["depth"] = _depths(session, place, missed)
    if layers := [name for name in aovs_from("coverage") if name in names]:
        pictures |= coverage(session, scene, layers)
    ids = _ids(session, scene, seen)
    pictures |= {name: np.where(missed, -1, numbers).astype(np.int32) for name, numbers in ids.items()}
    return {name: picture for name, picture in pictures.items() if name in names}


def first_hit_program(compiled: CompiledScene, names: Collection[str], *preamble: str) -> tuple[str, np.dtype[Any]]:
    """Return the program text, with only what `names` needs, and the record that it writes. preamble: definitions."""
    means, centers = _seen(names)
    fields = {"primitive": "i4", "instance": "i4", "pad": "2i4"}
    for name in means + centers:
        fields |= {name: "3f4", f"pad_{name}": "i4"}
    kind = record(**fields)
    defines = [
        f"#define {macro}(X) {' '.join(f'X({name})' for name in listed)}"
        for macro, listed in (("SEEN_MEANS", means), ("SEEN_MIDDLE", centers))
    ]
    reads = {AOV_TYPES[name].reads for name in means + centers}
    bent = "normal" in reads and "NORMAL_MAPS" in compiled.features
    materials = ["bsdf/dispatch.cl"] if bent or "bsdf" in reads else []
    return compiled.source_of(
        "aov/first_hit.cl",
        f"#define SEEN_MATERIALS {len(materials)}",
        typedefs({"FirstHit": kind}),
        *defines,
        *preamble,
        SEEN_FILES=materials,
    ), kind


def _kernel(session: Accumulation, names: Collection[str], *preamble: str) -> PerPixelKernel:
    """Return the kernel of `first_hit_program`."""
    program = partial(first_hit_program, session.compiled, names, *preamble)
    return per_pixel_kernel(session, ("first_hit", *_seen(names), *preamble), "first_hit", program)


def _samples(session: Accumulation) -> int:
    """Return the camera rays per pixel of AOVs that are means: those of the image, in whole blocks of its sampler's
    sequence, or SAMPLES if these are fewer."""
    return min(SAMPLES, 1 << int(session.launch["block_bits"][0]))


def _seen(names: Collection[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the AOVs that the kernel computes for `names`, those averaged over a pixel and those of its center."""
    needed = {*names, "position"} if "depth" in names else set(names)
    return (
        tuple(name for name in aovs_from("mean") if name in needed),
        tuple(name for name in aovs_from("center") if name in needed),
    )


def _positions(session: Accumulation, seen: NDArray[np.float64], missed: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return points (height, width, 3), given in the compiled scene's frame, in the world's; 0 where nothing is hit."""
    frame = session.compiled.frame
    return np.where(missed[..., None], 0, seen / frame.unit + frame.center).astype(np.float32)


def _depths(session: Accumulation, seen: NDArray[np.float64], missed: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the depth of points (height, width, 3) given in the compiled scene's frame; infinite where nothing is
    hit."""
    depth = np.empty(missed.shape)
    for rows, camera in _cameras(session):
        axis = np.subtract(camera.look_at, camera.position, dtype=np.float64)
        ahead = seen[rows] - camera.position
        depth[rows] = (
            np.linalg.norm(ahead, axis=-1) if camera.type.all_around else ahead @ (axis / np.linalg.norm(axis))
        )
    return np.where(missed, np.inf, depth / session.compiled.frame.unit).astype(np.float32)


def _cameras(session: Accumulation) -> Iterator[tuple[slice, Camera]]:
    """Yield rows of the image with the camera at the middle of their exposure."""
    camera, height = session.compiled.camera, session.size[1]
    if not camera.moves:
        yield slice(None), camera
        return
    middles = middle_of_rows(camera, height)
    for s in np.unique(middles):
        rows = np.flatnonzero(middles == s)
        yield slice(rows[0], rows[-1] + 1), camera_at(camera, float(s))


def coverage(session: Accumulation, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
    """Return Cryptomatte layers (height, width, 2 RANKS): what SAMPLES camera rays per pixel hit first, by coverage."""
    kernel = _kernel(session, (), "#define ONE_SAMPLE 1")
    hits: dict[str, list[NDArray[np.int64]]] = {name: [] for name in names}
    for number in range(SAMPLES):
        seen = render_pixels(session, kernel, SAMPLES, number)
        missed, ids = seen["primitive"] < 0, _ids(session, scene, seen)
        for name in names:
            hits[name].append(np.where(missed, -1, ids[name.removeprefix("crypto_")]))
    return {name: ranked(np.stack(hits[name], axis=-1), ids_of(NAMES[name](scene))) for name in names}


def ranked(hits: NDArray[np.int64], ids: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return pairs of id and coverage, (…, 2 RANKS), for numbers of what samples (…, n) hit, −1 for nothing."""
    distinct = np.unique(ids[hits[hits >= 0]])
    covered = [np.mean((hits >= 0) & (ids[hits] == each), axis=-1) for each in distinct]
    shares = np.stack(covered or [np.zeros(hits.shape[:-1])])
    order = np.argsort(-shares, axis=0, kind="stable")[:RANKS]
    best = np.take_along_axis(shares, order, axis=0)
    pairs = np.zeros((*hits.shape[:-1], RANKS, 2), np.float32)
    pairs[..., : len(order), 1] = np.moveaxis(best, 0, -1)
    if len(distinct):
        pairs[..., : len(order), 0] = np.moveaxis(np.where(best > 0, distinct[order], 0), 0, -1)
    return pairs.reshape(*hits.shape[:-1], 2 * RANKS)


def _ids(session: Accumulation, scene: Scene, seen: NDArray[Any]) -> dict[str, NDArray[np.int64]]:
    """Return the ids at first hits: the scene's object, its primitive, and its material."""
    place, primitive = session.compiled.objects.at_hits(seen["primitive"], seen["instance"])
    which, materials = np.array([*numbers_of(scene), -1])[place], np.array([*materials_of(scene)[1], -1])
    return {"primitive": primitive, "object": which, "material": materials[which]}
