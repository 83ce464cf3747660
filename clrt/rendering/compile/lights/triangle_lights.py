"""Packing of emissive triangles. Two that form a parallelogram, as in most area lights, become one light."""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....scene.materials.textures import Texture
from ....scene.model import Mesh
from ..geometry.pack_geometry import TriangleCorners
from ..geometry.pack_instances import PackedInstances
from ..materials.pack_textures import PackedTextures
from ..records import TRIANGLE_LIGHT
from .environment_map import LUMINANCE
from .hidden_lights import hidden_lights, opaque_and_sides
from .light_bounds import Doubles, LightGroups, flat_lights
from .mean_emission import mean_emission

#: Tolerance for parallelograms, in roundings of the largest coordinate of the four corners.
ROUNDINGS = 4

Integers = NDArray[np.int64]


class TriangleLights(NamedTuple):
    """Packed triangle lights. records: of n lights. groups: light bounds. light: (m,) int32, of each triangle, or
    −1. place: (n,) int32, the placements of those that move, or −1."""

    records: NDArray[Any]
    groups: LightGroups
    light: NDArray[np.int32]
    place: NDArray[np.int32]


def pack_triangle_lights(
    meshes: list[Mesh], textures: PackedTextures, placements: PackedInstances | None = None
) -> TriangleLights:
    """Pack the emissive triangles of the meshes, in order, except for those that are black, have no area in float32, or
    are hidden by an earlier one in the same place.

    Textured ones are never joined, and are sampled according to the texels they cover. Those whose opacity varies are
    not joined either, as it is read at the texture coordinates of one triangle. placements: of the first meshes, those
    of which that emit light move, and once each; their lights are in their own frames, and bounded in all poses.
    """
    mesh = np.repeat(np.arange(len(meshes)), [len(each.faces) for each in meshes])
    emission = np.array([each.material.radiance for each in meshes], np.float64).reshape(-1, 3)
    uneven = np.array([isinstance(each.material.emission, Texture) or _fades(each) for each in meshes], bool)
    texture = np.array(
        [
            textures.number(each.material.emission) if isinstance(each.material.emission, Texture) else -1
            for each in meshes
        ],
        np.int32,
    )
    shines: NDArray[np.bool_] = np.any(emission, axis=1)
    lamps = np.flatnonzero(shines[mesh])
    around = np.concatenate([np.ones((0, 3)), *map(mean_emission, itertools.compress(meshes, shines))])
    corners = np.asarray(TriangleCorners(list(itertools.compress(meshes, shines)))).astype(np.float64)
    area = _normals(corners)[1] / 2
    opaque, sides = opaque_and_sides([each.material for each in meshes])
    seen = (emission[mesh[lamps]] * around).any(axis=1) & (area.astype(np.float32) > 0)
    place = np.full(len(meshes), -1)
    if placements is not None:
        place[placements.mesh[placements.moving]] = placements.moving
    shapes = np.column_stack([corners.reshape(-1, 9), sides[mesh[lamps]], place[mesh[lamps]]])
    seen &= ~hidden_lights(shapes, opaque[mesh[lamps]])
    lamps, around = lamps[seen], around[seen]
    corners, whole = _joined(corners[seen], mesh[lamps], lamps, ~uneven[mesh[lamps]])
    begins = np.ones(len(lamps), bool)
    begins[1:] = ~whole[:-1]
    light = np.full(len(mesh), -1, np.int32)
    light[lamps] = np.cumsum(begins) - 1
    own = lamps[begins]
    both = np.array([each.material.double_sided for each in meshes], bool)[mesh[own]]
    records, groups = _packed(corners[begins], whole[begins], emission[mesh[own]], around[begins], both)
    records["texture"], records["primitive"] = texture[mesh[own]], own
    if placements is not None and (place[mesh[own]] >= 0).any():
        groups = _swept(groups, place[mesh[own]], placements)
    return TriangleLights(records, groups, light, place[mesh[own]].astype(np.int32))


def _swept(groups: LightGroups, place: Integers, placements: PackedInstances) -> LightGroups:
    """Return the bounds of n lights, of which those with a place (n,) of at least 0 move: they are bounded as if they
    emitted in all directions, with the larger one of the areas at both ends."""
    assert placements.motion is not None
    moving = place >= 0
    motion = placements.motion.of(np.searchsorted(placements.moving, place[moving]))
    low, high = groups.low.copy(), groups.high.copy()
    low[moving], high[moving] = motion.boxes(np.stack([groups.low, groups.high], axis=1)[moving])
    axis, cos_cone, radius, intensity = (
        each.copy() for each in (groups.axis, groups.cos_cone, groups.radius, groups.intensity)
    )
    axis[moving], cos_cone[moving] = 0, -1
    radius[moving] = np.linalg.norm(high - low, axis=1)[moving] / 2
    grown = [np.abs(np.linalg.det(motion.at(s)[..., :3])) ** (2 / 3) for s in (0.0, 1.0)]
    intensity[moving] *= np.maximum(*grown)
    return LightGroups(low, high, radius, axis, cos_cone, intensity, groups.cos_reach)


def _fades(mesh: Mesh) -> bool:
    """Return whether its opacity may vary over its triangles."""
    return isinstance(mesh.material.opacity, Texture) or (mesh.colors is not None and mesh.material.opacity != 1)


def _packed(
    corners: Doubles, whole: NDArray[np.bool_], radiance: Doubles, share: Doubles, both: NDArray[np.bool_]
) -> tuple[NDArray[Any], LightGroups]:
    """Pack triangles with corners (n, 3, 3) or, where `whole` (n,), the parallelograms with these three corners.

    share: (n, 3), average fraction of the radiance that they emit. both: (n,), which emit from both sides.
    """
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, area = _normals(corners)
    area = np.where(whole, area, area / 2)
    records = np.zeros(len(corners), TRIANGLE_LIGHT)
    records["p0"], records["e1"], records["e2"] = corners[:, 0], e1, e2
    records["area"], records["normal"], records["radiance"] = area, normal, radiance
    records["parallelogram"], records["double_sided"] = whole, both
    fourth = corners[:, 1] + np.where(whole[:, None], e2, 0)
    outline = np.concatenate([corners, fourth[:, None]], axis=1)
    return records, flat_lights(outline, normal, area * (radiance * share @ LUMINANCE), both)


def _normals(corners: Doubles) -> tuple[Doubles, Doubles]:
    """Return unit normals (k, 3), 0 if undefined, and twice the areas (k,) of triangles (k, 3, 3)."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    norm = np.linalg.norm(cross, axis=1)
    return cross / np.where(norm > 0, norm, 1)[:, None], norm


def _joined(
    corners: Doubles, mesh: Integers, face: Integers, plain: NDArray[np.bool_]
) -> tuple[Doubles, NDArray[np.bool_]]:
    """Return which of k triangles form a parallelogram with the next one, (k,); no triangle is in two of them.

    Their corners, (k, 3, 3), are rotated to begin with the one that is not shared. mesh, face: (k,); plain: (k,), which
    may be joined.
    """
    following = np.roll(corners, -1, axis=0)
    error = ROUNDINGS * 2.0**-24 * np.abs(corners).max(axis=(1, 2), initial=0)
    apex = np.full(len(corners), -1)
    for i in range(3):
        a = np.roll(corners, -i, axis=1)
        for j in range(3):
            b = np.roll(following, -j, axis=1)
            shared = np.all((a[:, 1] == b[:, 2]) & (a[:, 2] == b[:, 1]), axis=1)
            missed = np.abs(a[:, 0] + b[:, 0] - a[:, 1] - a[:, 2]).max(axis=1, initial=0)
            apex[shared & (missed <= error)] = i
    joined = (apex >= 0) & plain & (np.roll(face, -1) == face + 1) & (np.roll(mesh, -1) == mesh)
    # If several in a row could each be joined with the next, every other one is.
    here = np.arange(len(joined))
    since = here - np.maximum.accumulate(np.where(joined, -1, here))
    joined &= since % 2 == 1
    order = (np.where(joined, apex, 0)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners, order[..., None], axis=1), joined
